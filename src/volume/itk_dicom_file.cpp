#include <gdcmImage.h>
#include <gdcmReader.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <locale>
#include <sstream>
#include <vector>

#include "dicom_file.h"
#include "padding.h"
#include "value_conversion.h"
#include "xray_registration/common/dicom_structure.h"
#include "xray_registration/common/gdcm_image.h"
#include "xray_registration/common/itk_quiet.h"
#include "xray_registration/volume/volume_error.h"

// GDCM, which ITK reads DICOM with, by itself: ITK inverts MONOCHROME1, which only says how to show the values, and
// does not say which values are padding.

namespace xray_registration {
namespace {

// What lossless codecs make of slices that are all one value; more is no picture.
constexpr double kLargestCodecRatio = 20000.0;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

// DICOM text is padded with blanks or zeros to an even length.
std::string trimmed(std::string text) {
  const auto is_padding = [](char c) { return c == ' ' || c == '\0'; };
  while (!text.empty() && is_padding(text.back())) text.pop_back();
  while (!text.empty() && is_padding(text.front())) text.erase(text.begin());
  return text;
}

// The bytes of an element; empty when it is not there.
std::string bytesOf(const gdcm::DataSet& data, std::uint16_t group, std::uint16_t number) {
  const gdcm::Tag tag(group, number);
  if (!data.FindDataElement(tag)) return "";
  const gdcm::ByteValue* bytes = data.GetDataElement(tag).GetByteValue();
  return bytes == nullptr || bytes->GetPointer() == nullptr ? std::string()
                                                            : std::string(bytes->GetPointer(), bytes->GetLength());
}

std::string textOf(const gdcm::DataSet& data, std::uint16_t group, std::uint16_t number) {
  return trimmed(bytesOf(data, group, number));
}

// A number of 16 bits.
std::optional<std::uint16_t> shortOf(const gdcm::DataSet& data, std::uint16_t group, std::uint16_t number) {
  const std::string bytes = bytesOf(data, group, number);
  std::uint16_t value = 0;
  if (bytes.size() < sizeof(value)) return std::nullopt;
  std::memcpy(&value, bytes.data(), sizeof(value));
  return value;
}

// The numbers of a DICOM decimal string, divided by backslashes; false when there are not `count` of them.
bool parseNumbers(const std::string& text, double* numbers, std::size_t count) {
  std::istringstream stream(text);
  std::string part;
  std::size_t found = 0;
  while (std::getline(stream, part, '\\')) {
    std::istringstream number(part);
    number.imbue(std::locale::classic());
    if (found == count || !(number >> numbers[found]) || !std::isfinite(numbers[found])) return false;
    ++found;
  }
  return found == count;
}

bool parseGeometry(const gdcm::DataSet& data, DicomSlice* slice) {
  double orientation[6];
  double spacing[2];
  if (!parseNumbers(textOf(data, 0x20, 0x32), slice->position_mm.data(), 3)) return false;
  if (!parseNumbers(textOf(data, 0x20, 0x37), orientation, 6)) return false;
  if (!parseNumbers(textOf(data, 0x28, 0x30), spacing, 2)) return false;
  std::copy(orientation, orientation + 3, slice->along_row.begin());
  std::copy(orientation + 3, orientation + 6, slice->along_column.begin());
  slice->row_spacing_mm = spacing[0];
  slice->column_spacing_mm = spacing[1];
  return true;
}

// PixelPaddingValue and PixelPaddingRangeLimit (PS3.3 C.7.5.1.1.2), in the sign of the pixels.
std::optional<std::pair<int, int>> paddingOf(const gdcm::DataSet& data) {
  const auto value = shortOf(data, 0x28, 0x120);
  if (!value) return std::nullopt;
  const bool is_signed = shortOf(data, 0x28, 0x103).value_or(0) == 1;
  const auto number = [is_signed](std::uint16_t bits) {
    return is_signed ? static_cast<int>(static_cast<std::int16_t>(bits)) : static_cast<int>(bits);
  };
  const int limit = number(shortOf(data, 0x28, 0x121).value_or(*value));
  return std::minmax({number(*value), limit});
}

bool hasRoom(const gdcm::File& file, const DicomSlice& slice, const DicomStructure& structure) {
  if (!structure.pixels_fit) return false;
  const double bits = shortOf(file.GetDataSet(), 0x28, 0x100).value_or(16);
  const double bytes = bits / 8.0 * slice.columns * slice.rows * slice.frames * slice.components;
  const gdcm::TransferSyntax& syntax = file.GetHeader().GetDataSetTransferSyntax();
  const bool is_packed = syntax.IsEncapsulated();
  if (!is_packed && structure.pixel_bytes && *structure.pixel_bytes < bytes) return false;
  std::error_code error;
  const auto size = static_cast<double>(std::filesystem::file_size(slice.path, error));
  return error || size * (is_packed ? kLargestCodecRatio : 1.0) >= bytes;
}

// Runs GDCM's code and turns what it complains of into ours.
template <typename Work>
void withGdcm(const std::string& path, const Work& work) {
  const QuietItk quiet;
  try {
    work();
  } catch (const std::bad_alloc&) {
    refuse(path, "its pixels cannot be read: not enough memory for the size that its header states");
  }
  if (quiet.pixelsWereIncomplete()) refuse(path, "the file is truncated: it ends before its last pixel");
}

template <typename To>
void convertPixels(const gdcm::PixelFormat& format, const std::string& path, const std::vector<char>& bytes,
                   std::size_t count, const StoredScale& scale, const FileRule& rule, To* out, ValueFacts* facts) {
  const auto convert = [&](auto example) {
    using From = decltype(example);
    convertValues(reinterpret_cast<const From*>(bytes.data()), count, scale, rule, out, facts);
  };
  switch (format.GetScalarType()) {
    case gdcm::PixelFormat::UINT8:
      return convert(std::uint8_t{});
    case gdcm::PixelFormat::INT8:
      return convert(std::int8_t{});
    case gdcm::PixelFormat::UINT16:
      return convert(std::uint16_t{});
    case gdcm::PixelFormat::INT16:
      return convert(std::int16_t{});
    case gdcm::PixelFormat::UINT32:
      return convert(std::uint32_t{});
    case gdcm::PixelFormat::INT32:
      return convert(std::int32_t{});
    case gdcm::PixelFormat::FLOAT32:
      return convert(float{});
    case gdcm::PixelFormat::FLOAT64:
      return convert(double{});
    default:
      refuse(path, "its pixels have a type that no CT has");
  }
}

// RescaleSlope and RescaleIntercept (PS3.3 C.11.1).
StoredScale scaleOf(const gdcm::DataSet& data, const std::string& path) {
  StoredScale scale;
  const std::string slope = textOf(data, 0x28, 0x1053);
  const std::string intercept = textOf(data, 0x28, 0x1052);
  const bool is_read = (slope.empty() || parseNumbers(slope, &scale.slope, 1)) &&
                       (intercept.empty() || parseNumbers(intercept, &scale.intercept, 1));
  if (!is_read || scale.slope == 0.0) {
    refuse(path, "its RescaleSlope (0028,1053) or RescaleIntercept (0028,1052) is no number, or 0");
  }
  return scale;
}

template <typename To>
StoredScale readPixels(const DicomSlice& slice, const FileRule& rule, To* out, ValueFacts* facts) {
  StoredScale scale;
  withGdcm(slice.path, [&] {
    std::istringstream bytes_of_image(dicomBeginning(slice.path, slice.image_bytes));
    gdcm::Reader reader;
    reader.SetStream(bytes_of_image);
    gdcm::Image image;
    if (!reader.Read()) refuse(slice.path, "its pixels cannot be read");
    const std::optional<PixelBits> bits = imageOf(reader.GetFile(), &image);
    if (!bits || image.GetPixelFormat().GetBitsStored() != bits->stored) {
      refuse(slice.path, "its pixels cannot be read");
    }
    const std::size_t count = static_cast<std::size_t>(slice.rows) * static_cast<std::size_t>(slice.columns);
    const std::size_t pixel_bytes = image.GetPixelFormat().GetPixelSize();
    if (image.GetBufferLength() != count * pixel_bytes) {
      refuse(slice.path, "its header contradicts itself about its size");
    }
    std::vector<char> bytes(count * pixel_bytes);
    if (!image.GetBuffer(bytes.data())) {
      refuse(slice.path, "its pixels cannot be read: they are damaged or packed in a way that is not known");
    }
    scale = scaleOf(reader.GetFile().GetDataSet(), slice.path);
    convertPixels(image.GetPixelFormat(), slice.path, bytes, count, scale, rule, out, facts);
  });
  return scale;
}

}  // namespace

std::optional<DicomSlice> readDicomHeader(const std::string& path, bool* is_damaged) {
  const DicomStructure structure = dicomStructure(path);
  *is_damaged = structure.is_dicom && !structure.is_whole;
  if (!structure.is_whole) return std::nullopt;
  const QuietItk quiet;
  std::istringstream header(dicomBeginning(path, structure.header_bytes));
  gdcm::Reader reader;
  reader.SetStream(header);
  // Reports, dose objects and directories have no rows: DICOM, but no image.
  if (!reader.CanRead() || !reader.ReadUpToTag(gdcm::Tag(0x7fdf, 0xffff))) return std::nullopt;
  const gdcm::DataSet& data = reader.GetFile().GetDataSet();
  DicomSlice slice;
  slice.path = path;
  slice.rows = shortOf(data, 0x28, 0x10).value_or(0);
  slice.columns = shortOf(data, 0x28, 0x11).value_or(0);
  if (slice.rows == 0 || slice.columns == 0) return std::nullopt;
  slice.series_uid = textOf(data, 0x20, 0xe);
  slice.instance_uid = textOf(data, 0x8, 0x18);
  slice.modality = textOf(data, 0x8, 0x60);
  slice.rescale_type = textOf(data, 0x28, 0x1054);
  double frames = 1.0;
  if (parseNumbers(textOf(data, 0x28, 0x8), &frames, 1)) slice.frames = static_cast<int>(std::clamp(frames, 1.0, 1e6));
  slice.components = shortOf(data, 0x28, 0x2).value_or(1);
  if (textOf(data, 0x28, 0x4) == "PALETTE COLOR") slice.components = 3;
  slice.has_value_table = data.FindDataElement(gdcm::Tag(0x28, 0x3000));
  slice.has_geometry = parseGeometry(data, &slice);
  slice.padding = paddingOf(data);
  slice.image_bytes = structure.image_bytes;
  slice.has_room = hasRoom(reader.GetFile(), slice, structure);
  return slice;
}

void readDicomPixels(const DicomSlice& slice, const FileRule& rule, std::int16_t* hu, ValueFacts* facts) {
  const StoredScale scale = readPixels(slice, rule, hu, facts);
  if (!slice.padding) return;
  const auto inHu = [&scale, &rule](int stored) {
    return static_cast<int>(
        roundedTo<std::int16_t>((stored * scale.slope + scale.intercept) * rule.slope + rule.intercept));
  };
  const auto [low, high] = std::minmax({inHu(slice.padding->first), inHu(slice.padding->second)});
  facts->padded += clearPadding(low, high, slice.columns, static_cast<std::size_t>(slice.rows), hu);
}

void readDicomPixels(const DicomSlice& slice, const FileRule& rule, std::uint16_t* labels, ValueFacts* facts) {
  readPixels(slice, rule, labels, facts);
}

}  // namespace xray_registration
