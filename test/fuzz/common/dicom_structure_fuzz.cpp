// The walk through a DICOM file that decides whether GDCM may see it.
#include "test/fuzz/fuzz_target.h"
#include "xray_registration/common/dicom_structure.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  const DicomStructure found =
      dicomStructure(fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "slice.dcm"));
  fuzz::require(found.is_dicom || !found.is_whole, "only DICOM is whole");
  fuzz::require(found.is_whole || !found.pixels_fit, "pixels fit only into what is whole");
  return 0;
}
