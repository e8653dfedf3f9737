#include "image/dicom/gdcm_file.h"

#include <gdcmDataSetHelper.h>
#include <gdcmImage.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "xray_registration/common/dicom_structure.h"
#include "xray_registration/common/escaped.h"
#include "xray_registration/common/gdcm_image.h"
#include "xray_registration/common/itk_quiet.h"
#include "xray_registration/image/xray_dicom.h"

namespace xray_registration::dicom {
namespace {

constexpr std::uint16_t kPatientGroup = 0x0010;
constexpr std::uint16_t kPixelGroup = 0x7FE0;
constexpr std::uint32_t kLongestValue = 1U << 19U;  // Tables of 2¹⁶ values are the longest that are looked at.
constexpr int kDeepest = 8;                         // Sequences in sequences.
constexpr int kLargestSide = 32768;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw XrayDicomError("'" + path + "': " + what);
}

/// The name of a transfer syntax; those that are rare keep their number.
std::string nameOf(const gdcm::TransferSyntax& syntax) {
  switch (static_cast<gdcm::TransferSyntax::TSType>(syntax)) {
    case gdcm::TransferSyntax::ImplicitVRLittleEndian:
    case gdcm::TransferSyntax::ExplicitVRLittleEndian:
    case gdcm::TransferSyntax::ExplicitVRBigEndian:
      return "uncompressed";
    case gdcm::TransferSyntax::JPEGBaselineProcess1:
    case gdcm::TransferSyntax::JPEGExtendedProcess2_4:
      return "JPEG";
    case gdcm::TransferSyntax::JPEGLosslessProcess14:
    case gdcm::TransferSyntax::JPEGLosslessProcess14_1:
      return "JPEG lossless";
    case gdcm::TransferSyntax::JPEGLSLossless:
    case gdcm::TransferSyntax::JPEGLSNearLossless:
      return "JPEG-LS";
    case gdcm::TransferSyntax::JPEG2000Lossless:
    case gdcm::TransferSyntax::JPEG2000:
      return "JPEG 2000";
    case gdcm::TransferSyntax::RLELossless:
      return "RLE";
    default:
      return gdcm::TransferSyntax::GetTSString(syntax);
  }
}

template <typename T>
std::vector<double> numbersIn(const gdcm::ByteValue& value) {
  std::vector<double> numbers(value.GetLength() / sizeof(T));
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    T number;
    std::memcpy(&number, value.GetPointer() + i * sizeof(T), sizeof(T));
    numbers[i] = static_cast<double>(number);
  }
  return numbers;
}

std::vector<std::string> wordsIn(const std::string& text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c == '\\') {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  for (std::string& word : words) {
    const auto first = word.find_first_not_of(' ');
    const auto last = word.find_last_not_of(std::string(" \0", 2));
    // They are shown, in warnings and tables; none that means something has to be escaped.
    word = first == std::string::npos || last == std::string::npos ? "" : escaped(word.substr(first, last - first + 1));
  }
  return words;
}

std::vector<double> numbersOf(const std::vector<std::string>& words) {
  std::vector<double> numbers;
  for (const std::string& word : words) {
    char* end = nullptr;
    const double number = std::strtod(word.c_str(), &end);
    if (word.empty() || *end != '\0') return {};
    numbers.push_back(number);
  }
  return numbers;
}

Element elementOf(const gdcm::VR& vr, const gdcm::ByteValue& value) {
  Element element;
  switch (static_cast<gdcm::VR::VRType>(vr)) {
    case gdcm::VR::US:
    case gdcm::VR::OW:
    case gdcm::VR::US_SS:
    case gdcm::VR::US_OW:
      element.numbers = numbersIn<std::uint16_t>(value);
      break;
    case gdcm::VR::SS:
      element.numbers = numbersIn<std::int16_t>(value);
      break;
    case gdcm::VR::UL:
      element.numbers = numbersIn<std::uint32_t>(value);
      break;
    case gdcm::VR::SL:
      element.numbers = numbersIn<std::int32_t>(value);
      break;
    case gdcm::VR::FL:
      element.numbers = numbersIn<float>(value);
      break;
    case gdcm::VR::FD:
      element.numbers = numbersIn<double>(value);
      break;
    case gdcm::VR::UN:
    case gdcm::VR::OB:
    case gdcm::VR::INVALID:
      element.bytes.assign(value.GetPointer(), value.GetLength());
      break;
    default:
      element.words = wordsIn(std::string(value.GetPointer(), value.GetLength()));
      element.numbers = numbersOf(element.words);
  }
  return element;
}

bool isLeftOut(const gdcm::DataElement& element, const gdcm::VR& vr) {
  const gdcm::Tag& tag = element.GetTag();
  return tag.GetGroup() == kPatientGroup || tag.GetGroup() >= kPixelGroup || tag.GetElement() == 0 ||
         vr == gdcm::VR::PN;
}

DataSet dataSetOf(const gdcm::File& file, const gdcm::DataSet& set, int depth) {
  DataSet result;
  for (const gdcm::DataElement& element : set.GetDES()) {
    const gdcm::VR vr = gdcm::DataSetHelper::ComputeVR(file, set, element.GetTag());
    if (isLeftOut(element, vr)) continue;
    const Tag tag = element.GetTag().GetElementTag();
    if (vr == gdcm::VR::SQ) {
      const auto sequence = element.GetValueAsSQ();
      if (!sequence || depth >= kDeepest) continue;
      for (std::size_t i = 1; i <= sequence->GetNumberOfItems(); ++i) {
        result.elements[tag].items.push_back(dataSetOf(file, sequence->GetItem(i).GetNestedDataSet(), depth + 1));
      }
      continue;
    }
    const gdcm::ByteValue* value = element.GetByteValue();
    if (value == nullptr || value->GetLength() > kLongestValue) continue;
    result.elements[tag] = elementOf(vr, *value);
  }
  return result;
}

void checkImage(const gdcm::Image& image, const std::string& path) {
  const gdcm::PixelFormat& format = image.GetPixelFormat();
  if (format.GetSamplesPerPixel() != 1) refuse(path, "it is a colour image; an X-ray has one number per pixel");
  if (image.GetColumns() < 1 || image.GetRows() < 1 || image.GetColumns() > kLargestSide ||
      image.GetRows() > kLargestSide) {
    refuse(path, "its size is impossible");
  }
  if (format.GetBitsAllocated() != 8 && format.GetBitsAllocated() != 16) {
    refuse(path, "it has " + std::to_string(format.GetBitsAllocated()) + " bits for a pixel; 8 and 16 are read");
  }
}

void readPixels(const gdcm::Image& image, const DicomStructure& structure, const std::string& path,
                FileContents* contents) {
  checkImage(image, path);
  const gdcm::PixelFormat& format = image.GetPixelFormat();
  contents->width = static_cast<int>(image.GetColumns());
  contents->height = static_cast<int>(image.GetRows());
  contents->frames = image.GetNumberOfDimensions() > 2 ? image.GetDimension(2) : 1;
  contents->bits.bytes = format.GetBitsAllocated() / 8;
  contents->bits.is_signed = format.GetPixelRepresentation() == 1;
  const std::size_t size = contents->frames * image.GetColumns() * image.GetRows() * format.GetPixelSize();
  contents->pixels.resize(image.GetBufferLength());
  const bool is_packed = image.GetTransferSyntax().IsEncapsulated();
  if (!is_packed && structure.pixel_bytes && *structure.pixel_bytes < contents->pixels.size()) {
    refuse(path, "the file is truncated: it ends before its last pixel");
  }
  if (contents->pixels.size() < size || !image.GetBuffer(contents->pixels.data())) {
    refuse(path, "its pixels (" + contents->transfer_syntax + ") cannot be decoded; the file is damaged?");
  }
}

}  // namespace

std::int32_t StoredBits::value(const char* pixel) const {
  std::uint16_t word = static_cast<std::uint8_t>(*pixel);
  if (bytes == 2) std::memcpy(&word, pixel, sizeof word);
  const std::uint32_t full = 1U << static_cast<unsigned>(count);
  const std::uint32_t bits = (static_cast<std::uint32_t>(word) >> static_cast<unsigned>(shift)) & (full - 1U);
  const bool negative = is_signed && (bits & (full >> 1U)) != 0;
  return static_cast<std::int32_t>(bits) - (negative ? static_cast<std::int32_t>(full) : 0);
}

FileContents readFile(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) refuse(path, "there is no such file");
  if (!std::ifstream(path)) refuse(path, "the file cannot be opened; are you allowed to read it?");
  if (!looksLikeDicom(path)) refuse(path, "it is no DICOM file");
  const DicomStructure structure = dicomStructure(path);
  if (structure.is_deflated) refuse(path, "its elements are deflated, which is not read; unpack it (dcmconv +te)");
  if (!structure.is_whole) refuse(path, "it is cut off or damaged: its elements do not end within it");
  if (!structure.pixels_fit) refuse(path, "the file is truncated or damaged: its pixels do not end within it");
  const QuietItk quiet;
  FileContents contents;
  try {
    gdcm::Reader reader;
    std::istringstream without_rest;
    if (structure.image_bytes < std::filesystem::file_size(path)) {
      without_rest.str(dicomBeginning(path, structure.image_bytes));
      reader.SetStream(without_rest);
    } else {
      reader.SetFileName(path.c_str());
    }
    if (!reader.Read()) refuse(path, "it is DICOM, but holds no image that can be read");
    gdcm::Image image;
    const std::optional<PixelBits> bits = imageOf(reader.GetFile(), &image);
    if (!bits) refuse(path, "it is DICOM, but holds no image that can be read");
    contents.bits.count = bits->stored;
    contents.bits.shift = bits->high + 1 - bits->stored;
    contents.transfer_syntax = nameOf(image.GetTransferSyntax());
    readPixels(image, structure, path, &contents);
    contents.attributes = dataSetOf(reader.GetFile(), reader.GetFile().GetDataSet(), 0);
  } catch (const XrayDicomError&) {
    throw;
  } catch (const std::exception& error) {
    refuse(path, std::string("it is DICOM, but no image that can be read: ") + error.what());
  }
  if (quiet.pixelsWereIncomplete()) refuse(path, "the file is truncated: it ends before its last pixel");
  return contents;
}

}  // namespace xray_registration::dicom
