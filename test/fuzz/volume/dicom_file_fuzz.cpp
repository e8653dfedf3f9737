// A DICOM file as a slice of a CT and as an X-ray: our walk through it, then GDCM.
#include "test/fuzz/fuzz_target.h"
#include "volume/dicom_file.h"
#include "xray_registration/image/xray_dicom.h"
#include "xray_registration/image/xray_dicom_geometry.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration::fuzz {
namespace {

void readSlice(const std::string& path) {
  bool is_damaged = false;
  const auto slice = readDicomHeader(path, &is_damaged);
  if (!slice || !slice->has_room || slice->components != 1 || slice->frames != 1) return;
  std::vector<std::int16_t> hu(static_cast<std::size_t>(slice->rows) * static_cast<std::size_t>(slice->columns));
  ValueFacts facts;
  readDicomPixels(*slice, {}, hu.data(), &facts);
}

void readXray(const std::string& path) {
  const XrayDicomFile file(path);
  for (std::size_t i = 0; i < file.header().frames.size(); ++i) {
    file.frame(i, false);
    dicomGeometry(file.header(), file.header().frames[i]);
  }
}

}  // namespace
}  // namespace xray_registration::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  const std::string path = fuzz::fileOf(std::string(reinterpret_cast<const char*>(data), size), "slice.dcm");
  try {
    fuzz::readSlice(path);
  } catch (const VolumeError& error) {
    fuzz::requireWords(error.what());
  }
  try {
    fuzz::readXray(path);
  } catch (const XrayDicomError& error) {
    fuzz::requireWords(error.what());
  }
  return 0;
}
