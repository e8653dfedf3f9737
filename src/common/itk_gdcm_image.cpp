#include <gdcmFile.h>
#include <gdcmImage.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>

#include "xray_registration/common/gdcm_image.h"

// The attributes: DICOM PS3.3, C.7.6.3 (Image Pixel) and C.7.6.6 (Multi-frame).

namespace xray_registration {
namespace {

constexpr long kMostFrames = 1000000;

std::string bytesOf(const gdcm::DataSet& data, std::uint16_t group, std::uint16_t number) {
  const gdcm::Tag tag(group, number);
  if (!data.FindDataElement(tag)) return {};
  const gdcm::ByteValue* value = data.GetDataElement(tag).GetByteValue();
  if (value == nullptr || value->GetPointer() == nullptr) return {};
  return {value->GetPointer(), value->GetLength()};
}

std::optional<std::uint16_t> shortOf(const gdcm::DataSet& data, std::uint16_t number) {
  const std::string bytes = bytesOf(data, 0x28, number);
  std::uint16_t value = 0;
  if (bytes.size() < sizeof value) return std::nullopt;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

struct Format {
  gdcm::PixelFormat gdcm;
  PixelBits bits;
};

std::optional<Format> formatOf(const gdcm::DataSet& data) {
  const std::uint16_t samples = shortOf(data, 0x2).value_or(1);
  const std::uint16_t allocated = shortOf(data, 0x100).value_or(16);
  const std::uint16_t stored = shortOf(data, 0x101).value_or(allocated);
  const int high = shortOf(data, 0x102).value_or(stored - 1);
  const std::uint16_t representation = shortOf(data, 0x103).value_or(0);
  const bool can_be = (samples == 1 || samples == 3 || samples == 4) && stored >= 1 && stored <= allocated &&
                      high < allocated && high + 1 >= stored && representation <= 1;
  if (!can_be) return std::nullopt;
  // GDCM clears other bits in words of 16 alone, and knows no number that lies higher than it has to.
  const std::uint16_t known_stored = allocated == 16 && high + 1 == stored ? stored : allocated;
  for (const std::uint16_t known : {8, 16, 32, 64}) {
    if (allocated != known) continue;
    return Format{gdcm::PixelFormat(samples, allocated, known_stored, known_stored - 1, representation),
                  {stored, high}};
  }
  return std::nullopt;
}

bool isPhotometricKnown(const gdcm::DataSet& data) {
  const std::string text = bytesOf(data, 0x28, 0x4);
  using gdcm::PhotometricInterpretation;
  return text.empty() || PhotometricInterpretation::GetPIType(text.c_str()) != PhotometricInterpretation::PI_END;
}

}  // namespace

std::optional<PixelBits> imageOf(const gdcm::File& file, gdcm::Image* image) {
  const gdcm::DataSet& data = file.GetDataSet();
  const gdcm::Tag pixels(0x7fe0, 0x10);
  const std::uint16_t rows = shortOf(data, 0x10).value_or(0);
  const std::uint16_t columns = shortOf(data, 0x11).value_or(0);
  const std::optional<Format> format = formatOf(data);
  if (!data.FindDataElement(pixels) || data.GetDataElement(pixels).IsEmpty()) return std::nullopt;
  if (rows == 0 || columns == 0 || !format || !isPhotometricKnown(data)) return std::nullopt;
  const std::string frames_text = bytesOf(data, 0x28, 0x8);
  const long frames = frames_text.empty() ? 1 : std::strtol(frames_text.c_str(), nullptr, 10);
  if (frames < 1 || frames > kMostFrames) return std::nullopt;
  image->SetNumberOfDimensions(frames > 1 ? 3 : 2);
  image->SetDimension(0, columns);
  image->SetDimension(1, rows);
  if (frames > 1) image->SetDimension(2, static_cast<unsigned>(frames));
  image->SetPixelFormat(format->gdcm);
  const bool is_grey = format->gdcm.GetSamplesPerPixel() == 1;
  if (!is_grey) image->SetPlanarConfiguration(shortOf(data, 0x6).value_or(0) == 1 ? 1 : 0);
  // The numbers as they are stored, whatever they mean.
  image->SetPhotometricInterpretation(is_grey ? gdcm::PhotometricInterpretation::MONOCHROME2
                                              : gdcm::PhotometricInterpretation::RGB);
  const gdcm::TransferSyntax syntax = file.GetHeader().GetDataSetTransferSyntax();
  image->SetTransferSyntax(syntax);
  image->SetNeedByteSwap(syntax == gdcm::TransferSyntax::ImplicitVRBigEndianPrivateGE);
  image->SetDataElement(data.GetDataElement(pixels));
  return format->bits;
}

}  // namespace xray_registration
