// Names of segments in the header of a 3D Slicer segmentation.
#include "test/fuzz/fuzz_target.h"
#include "xray_registration/volume/segment_names.h"
#include "xray_registration/volume/volume_error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  const std::string path = fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "labels.seg.nrrd");
  try {
    segmentNames(path, "");
    labelsNamed({"T12"}, path, "");
  } catch (const VolumeError& error) {
    fuzz::requireWords(error.what());
  }
  return 0;
}
