#include "xray_registration/image/xray_dicom.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "image/dicom/facts.h"
#include "image/dicom/gdcm_file.h"
#include "image/dicom/pixel_values.h"

namespace xray_registration {

struct XrayDicomFile::Contents {
  dicom::FileContents file;
  DicomHeader header;
  dicom::PixelValues values;
};

XrayDicomFile::XrayDicomFile(const std::string& path) : contents_(std::make_unique<Contents>()) {
  Contents& self = *contents_;
  self.file = dicom::readFile(path);
  self.header = dicom::headerOf(self.file.attributes, self.file.frames);
  self.header.width = self.file.width;
  self.header.height = self.file.height;
  self.header.bits = self.file.bits.count;
  self.header.transfer_syntax = self.file.transfer_syntax;
  if (self.header.photometric.compare(0, 10, "MONOCHROME") != 0) {
    throw XrayDicomError(
        "'" + path + "': its values are " +
        (self.header.photometric.empty() ? "of a kind that it does not state" : self.header.photometric) +
        "; an X-ray is MONOCHROME1 or MONOCHROME2");
  }
  self.values = dicom::PixelValues(self.file.attributes, self.file.bits.count, self.file.bits.is_signed);
}

XrayDicomFile::~XrayDicomFile() = default;
XrayDicomFile::XrayDicomFile(XrayDicomFile&&) noexcept = default;
XrayDicomFile& XrayDicomFile::operator=(XrayDicomFile&&) noexcept = default;

const DicomHeader& XrayDicomFile::header() const { return contents_->header; }
double XrayDicomFile::fullScale() const { return contents_->values.fullScale(); }
bool XrayDicomFile::isIntegral() const { return contents_->values.isIntegral(); }

FloatImage XrayDicomFile::frame(std::size_t index, bool reversed) const {
  const Contents& self = *contents_;
  if (index >= self.file.frames) throw std::out_of_range("frame " + std::to_string(index) + " of an X-ray");
  FloatImage image(self.file.width, self.file.height);
  const auto bytes = static_cast<std::size_t>(self.file.bits.bytes);
  const char* pixel = self.file.pixels.data() + index * image.pixels.size() * bytes;
  for (float& value : image.pixels) {
    const double stored = self.values.of(self.file.bits.value(pixel));
    value = static_cast<float>(reversed ? self.values.fullScale() - stored : stored);
    pixel += bytes;
  }
  return image;
}

bool looksLikeDicom(const std::string& path) {
  constexpr std::streamoff kPreamble = 128;
  std::ifstream stream(path, std::ios::binary);
  std::array<char, 4> mark{};
  stream.seekg(kPreamble);
  stream.read(mark.data(), mark.size());
  return stream.good() && std::equal(mark.begin(), mark.end(), "DICM");
}

}  // namespace xray_registration
