#pragma once

#include <stdlib.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <locale>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

// Files as other programs write them, byte by byte from their standards, so that the readers are checked against
// something that is not the project's own writer.

namespace xray_registration {
namespace test_files {

namespace fs = std::filesystem;

/// A folder of its own, gone with the object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "xray_registration_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder can be made");
    path_ = fs::canonical(pattern);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

inline void writeBytes(const std::string& path, const std::string& bytes) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

template <typename T>
std::string bytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// NIfTI-1 with an sform (rows of the matrix from voxel index to RAS in mm).
template <typename T>
void writeNifti(const std::string& path, const std::vector<std::int16_t>& size, std::int16_t datatype,
                const std::vector<T>& voxels, const std::array<std::array<float, 4>, 3>& ras_from_index,
                float slope = 1.0F, float intercept = 0.0F) {
  std::string header(352, '\0');
  const auto put = [&header](std::size_t offset, const auto& value) {
    std::memcpy(&header[offset], &value, sizeof(value));
  };
  put(0, std::int32_t{348});
  put(40, static_cast<std::int16_t>(size.size()));
  put(76, 1.0F);
  for (std::size_t i = 0; i < 7; ++i) {
    put(42 + 2 * i, i < size.size() ? size[i] : std::int16_t{1});
    float spacing = 1.0F;
    if (i < 3) {
      spacing = std::sqrt(ras_from_index[0][i] * ras_from_index[0][i] + ras_from_index[1][i] * ras_from_index[1][i] +
                          ras_from_index[2][i] * ras_from_index[2][i]);
    }
    put(80 + 4 * i, spacing);
  }
  put(70, datatype);
  put(72, static_cast<std::int16_t>(8 * sizeof(T)));
  put(108, 352.0F);
  put(112, slope);
  put(116, intercept);
  header[123] = 2;  // Millimetres.
  put(254, std::int16_t{1});
  for (std::size_t row = 0; row < 3; ++row) put(280 + 16 * row, ras_from_index[row]);
  std::memcpy(&header[344], "n+1", 4);
  writeBytes(path, header + bytesOf(voxels));
}

struct DicomFile {
  std::string series_uid = "1.2.3.1";
  std::string instance_uid = "1.2.3.1.1";
  std::string modality = "CT";
  std::array<double, 3> position{};
  std::array<double, 6> orientation{1, 0, 0, 0, 1, 0};
  std::array<double, 2> pixel_spacing{1.0, 1.0};  ///< Between rows, between columns.
  int columns = 0;
  int rows = 0;
  double slope = 1.0;
  double intercept = -1024.0;
  int samples_per_pixel = 1;
  bool has_position = true;
  std::string photometric = "MONOCHROME2";
  bool has_rescale = true;
  std::string rescale_type;
  bool is_signed = false;
  std::optional<std::uint16_t> padding;
  std::optional<std::uint16_t> padding_limit;
  std::vector<std::uint16_t> pixels;
};

/// DICOM part 10, explicit VR little endian.
inline void writeDicom(const std::string& path, const DicomFile& file) {
  const auto element = [](std::uint16_t group, std::uint16_t number, const std::string& vr, std::string value) {
    if (value.size() % 2 == 1) value += vr == "UI" ? '\0' : ' ';
    std::string bytes;
    const auto add = [&bytes](const auto& number_value) {
      bytes.append(reinterpret_cast<const char*>(&number_value), sizeof(number_value));
    };
    add(group);
    add(number);
    bytes += vr;
    if (vr == "OB" || vr == "OW") {
      add(std::uint16_t{0});
      add(static_cast<std::uint32_t>(value.size()));
    } else {
      add(static_cast<std::uint16_t>(value.size()));
    }
    return bytes + value;
  };
  const auto us = [](int value) {
    const auto number = static_cast<std::uint16_t>(value);
    return std::string(reinterpret_cast<const char*>(&number), 2);
  };
  const auto numbers = [](const auto& values) {
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(10);
    for (std::size_t i = 0; i < values.size(); ++i) text << (i > 0 ? "\\" : "") << values[i];
    return text.str();
  };
  const std::string ct_class = "1.2.840.10008.5.1.4.1.1.2";
  std::string meta = element(2, 1, "OB", std::string("\0\1", 2)) + element(2, 2, "UI", ct_class) +
                     element(2, 3, "UI", file.instance_uid) + element(2, 0x10, "UI", "1.2.840.10008.1.2.1") +
                     element(2, 0x12, "UI", "1.2.3.4");
  const auto meta_length = static_cast<std::uint32_t>(meta.size());
  std::string bytes = std::string(128, '\0') + "DICM" +
                      element(2, 0, "UL", std::string(reinterpret_cast<const char*>(&meta_length), 4)) + meta;
  bytes += element(8, 0x16, "UI", ct_class) + element(8, 0x18, "UI", file.instance_uid) +
           element(8, 0x60, "CS", file.modality) + element(0x10, 0x10, "PN", "SECRET^NAME") +
           element(0x20, 0xd, "UI", "1.2.3") + element(0x20, 0xe, "UI", file.series_uid);
  if (file.has_position) {
    bytes += element(0x20, 0x32, "DS", numbers(file.position)) + element(0x20, 0x37, "DS", numbers(file.orientation));
  }
  bytes += element(0x28, 2, "US", us(file.samples_per_pixel)) +
           element(0x28, 4, "CS", file.samples_per_pixel == 1 ? file.photometric : "RGB");
  if (file.samples_per_pixel > 1) bytes += element(0x28, 6, "US", us(0));
  bytes += element(0x28, 0x10, "US", us(file.rows)) + element(0x28, 0x11, "US", us(file.columns)) +
           element(0x28, 0x30, "DS", numbers(file.pixel_spacing));
  const int bits = file.samples_per_pixel == 1 ? 16 : 8;
  bytes += element(0x28, 0x100, "US", us(bits)) + element(0x28, 0x101, "US", us(bits)) +
           element(0x28, 0x102, "US", us(bits - 1)) + element(0x28, 0x103, "US", us(file.is_signed ? 1 : 0));
  const std::string padding_vr = file.is_signed ? "SS" : "US";
  if (file.padding) bytes += element(0x28, 0x120, padding_vr, us(*file.padding));
  if (file.padding_limit) bytes += element(0x28, 0x121, padding_vr, us(*file.padding_limit));
  if (file.samples_per_pixel == 1 && file.has_rescale) {
    bytes += element(0x28, 0x1052, "DS", numbers(std::array<double, 1>{file.intercept})) +
             element(0x28, 0x1053, "DS", numbers(std::array<double, 1>{file.slope}));
    if (!file.rescale_type.empty()) bytes += element(0x28, 0x1054, "LO", file.rescale_type);
  }
  std::string pixels = bytesOf(file.pixels);
  if (file.samples_per_pixel > 1) {
    pixels.assign(static_cast<std::size_t>(file.rows * file.columns * file.samples_per_pixel), '\7');
  }
  writeBytes(path, bytes + element(0x7fe0, 0x10, "OW", pixels));
}

}  // namespace test_files
}  // namespace xray_registration
