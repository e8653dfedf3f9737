// NIfTI-1 and NIfTI-2, compressed or not.
#include "test/fuzz/volume/volume_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  fuzz::readBoth(fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "ct.nii"));
  return 0;
}
