// Points and pixels of landmarks: a table, 3D Slicer's markups in JSON, and its older table. The first byte says which.
#include <stdexcept>

#include "test/fuzz/fuzz_target.h"
#include "tools/landmarks/points_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  fuzz::Bytes bytes(data, size);
  const auto kind = bytes.take<std::uint8_t>();
  const char* names[] = {"points.csv", "points.mrk.json", "points.fcsv"};
  const std::string path = fuzz::fileOf(bytes.rest(), names[kind % 3]);
  try {
    const auto points = tools::readPointsFile(path);
    fuzz::require(!points.empty(), "a file that is read has points");
    for (const auto& point : points) fuzz::require(point.point_ct.allFinite(), "points are finite");
  } catch (const std::runtime_error& error) {
    fuzz::require(error.what()[0] != '\0', "a refusal has words");
  }
  try {
    for (const auto& [name, pixels] : tools::readPixelsFile(path)) {
      for (const auto& pixel : pixels) fuzz::require(pixel.pixel.allFinite(), "pixels are finite");
    }
  } catch (const std::runtime_error& error) {
    fuzz::require(error.what()[0] != '\0', "a refusal has words");
  }
  return 0;
}
