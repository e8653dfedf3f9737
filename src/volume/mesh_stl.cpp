#include <utility>

#include "mesh_readers.h"
#include "mesh_repair.h"
#include "mesh_scanner.h"

// STL: 80 bytes of anything, the number of triangles, and 50 bytes for each; or text from `solid` to `endsolid`.

namespace xray_registration {
namespace {

constexpr std::size_t kHeaderBytes = 84;
constexpr std::size_t kTriangleBytes = 50;

std::uint64_t statedTriangles(const std::string& bytes, const std::string& path) {
  const std::string number = bytes.substr(kHeaderBytes - 4, 4);
  MeshScanner scanner(number, path);
  scanner.setEncoding(MeshScanner::Encoding::kLittleEndian);
  return scanner.count(NumberType::kUint32, 0xffffffff);
}

Eigen::Vector3f readPoint(MeshScanner* scanner) {
  Eigen::Vector3f point;
  for (int i = 0; i < 3; ++i) point[i] = static_cast<float>(scanner->number(NumberType::kFloat));
  return point;
}

// Points three by three.
SurfaceMesh meshOf(std::vector<Eigen::Vector3f> points) {
  SurfaceMesh mesh;
  mesh.points_mm = std::move(points);
  mesh.triangles.reserve(mesh.points_mm.size() / 3);
  for (std::uint32_t i = 0; i + 2 < mesh.points_mm.size(); i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
  return withMergedPoints(mesh);
}

SurfaceMesh readBinary(const std::string& bytes, std::uint64_t triangles, const std::string& path) {
  const std::string body = bytes.substr(kHeaderBytes);
  MeshScanner scanner(body, path);
  scanner.setEncoding(MeshScanner::Encoding::kLittleEndian);
  std::vector<Eigen::Vector3f> points;
  points.reserve(3 * triangles);
  for (std::uint64_t i = 0; i < triangles; ++i) {
    readPoint(&scanner);  // The normal; the corners' order says the same.
    for (int corner = 0; corner < 3; ++corner) points.push_back(readPoint(&scanner));
    scanner.number(NumberType::kUint16);
  }
  return meshOf(std::move(points));
}

SurfaceMesh readText(const std::string& bytes, const std::string& path) {
  MeshScanner scanner(bytes, path);
  std::vector<Eigen::Vector3f> points;
  bool ended = false;
  for (std::string word = scanner.word(); !word.empty(); word = scanner.word()) {
    if (word == "solid" || word == "endsolid") {
      scanner.line();  // Its name, which may be several words.
      ended = word == "endsolid";
    } else if (word == "vertex") {
      points.push_back(readPoint(&scanner));
    } else if (word == "endfacet" && points.size() % 3 != 0) {
      refuseMesh(path, "a facet of it has not three corners");
    }
  }
  if (!ended) refuseMesh(path, "the STL file ends before its 'endsolid'; it is truncated");
  return meshOf(std::move(points));
}

}  // namespace

SurfaceMesh readStl(const std::string& bytes, const std::string& path) {
  const bool may_be_text = bytes.compare(0, 5, "solid") == 0;
  if (bytes.size() >= kHeaderBytes) {
    // Programs write `solid` into the header of binary files too, so the size decides.
    const std::uint64_t triangles = statedTriangles(bytes, path);
    const std::uint64_t needed = kHeaderBytes + triangles * kTriangleBytes;
    if (bytes.size() == needed || (!may_be_text && bytes.size() > needed && triangles > 0)) {
      return readBinary(bytes, triangles, path);
    }
  }
  if (may_be_text) return readText(bytes, path);
  refuseMesh(path, "it is no STL, PLY or VTK file, or a truncated binary STL");
}

}  // namespace xray_registration
