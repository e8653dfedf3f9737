// MetaImage, which ITK reads once our own look at its header has passed.
#include "test/fuzz/volume/volume_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  fuzz::readBoth(fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "ct.mha"));
  return 0;
}
