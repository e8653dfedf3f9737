#include "xray_registration/volume/surface_mesh.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "file_boundary.h"
#include "mesh_readers.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{1} << 30U;

std::string contentOf(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) refuseMesh(path, "it is a folder; name the file of the mesh");
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) refuseMesh(path, "it cannot be read: " + error.message());
  if (size > kMaxFileBytes) refuseMesh(path, "it is larger than 1 GiB; reduce the mesh's triangles");
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  if (!stream) refuseMesh(path, "it cannot be read");
  return bytes;
}

SurfaceMesh parsed(const std::string& bytes, const std::string& path) {
  const auto starts = [&bytes](const char* text) { return bytes.rfind(text, 0) == 0; };
  if (starts("ply\n") || starts("ply\r")) return readPly(bytes, path);
  if (starts("# vtk DataFile")) return readVtk(bytes, path);
  if (starts("<?xml") || starts("<VTKFile")) {
    refuseMesh(path, "XML files (.vtp) are not read; save the mesh as STL, PLY or legacy .vtk");
  }
  return readStl(bytes, path);
}

void check(const SurfaceMesh& mesh, const std::string& path) {
  if (mesh.triangles.empty()) refuseMesh(path, "it holds no triangles");
  for (const Eigen::Vector3f& point : mesh.points_mm) {
    if (!point.allFinite()) refuseMesh(path, "a coordinate in it is no finite number");
  }
  for (const auto& triangle : mesh.triangles) {
    if (*std::max_element(triangle.begin(), triangle.end()) >= mesh.points_mm.size()) {
      refuseMesh(path, "a triangle of it names a point that is not there; it is damaged");
    }
  }
}

}  // namespace

void refuseMesh(const std::string& path, const std::string& what) { throw VolumeError("'" + path + "': " + what); }

void addPolygon(const std::vector<std::uint32_t>& corners, SurfaceMesh* mesh) {
  for (std::size_t i = 2; i < corners.size(); ++i) {
    mesh->triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
}

SurfaceMesh readMesh(const std::string& path, const std::string& directory) {
  const std::string real = checkedPath(path, directory);
  SurfaceMesh mesh = parsed(contentOf(real), path);
  check(mesh, path);
  return mesh;
}

}  // namespace xray_registration
