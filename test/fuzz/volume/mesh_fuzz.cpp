// Meshes: STL, PLY and VTK, told apart by their content.
#include "test/fuzz/fuzz_target.h"
#include "xray_registration/volume/surface_mesh.h"
#include "xray_registration/volume/volume_error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  const std::string path = fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "mesh.stl");
  try {
    const SurfaceMesh mesh = readMesh(path, "");
    for (const auto& triangle : mesh.triangles) {
      for (const auto corner : triangle) fuzz::require(corner < mesh.points_mm.size(), "corners are there");
    }
    for (const auto& point : mesh.points_mm) fuzz::require(point.allFinite(), "points are finite");
  } catch (const VolumeError& error) {
    fuzz::requireWords(error.what());
  }
  return 0;
}
