#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "test/volume/test_files.h"

namespace xray_registration {
namespace test_files {

/// A NIfTI file with every field that says where the voxels lie, byte by byte from nifti1.h and nifti2.h.
struct NiftiFile {
  int version = 1;
  bool big_endian = false;
  std::array<std::int64_t, 3> size{4, 3, 2};
  std::int16_t datatype = 4;
  std::array<double, 4> pixdim{1.0, 2.0, 3.0, 4.0};  ///< The first is qfac.
  double slope = 1.0;
  double intercept = 0.0;
  int units = 2;
  int qform_code = 0;
  int sform_code = 0;
  std::array<double, 6> quatern{};  ///< b, c, d, offset
  std::array<std::array<double, 4>, 3> srow{};
  std::string voxels = std::string(48, '\0');
};

/// With the numbers of `values` as voxels, in the file's byte order.
template <typename T>
void setVoxels(const std::vector<T>& values, NiftiFile* file) {
  file->voxels = bytesOf(values);
  if (!file->big_endian) return;
  for (std::size_t i = 0; i < file->voxels.size(); i += sizeof(T)) {
    std::reverse(file->voxels.begin() + static_cast<std::ptrdiff_t>(i),
                 file->voxels.begin() + static_cast<std::ptrdiff_t>(i + sizeof(T)));
  }
}

inline std::string niftiBytes(const NiftiFile& file) {
  const bool first = file.version == 1;
  std::string header(first ? 352 : 544, '\0');
  const auto put = [&](std::size_t offset, auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof(value));
    if (file.big_endian) std::reverse(bytes.begin(), bytes.end());
    header.replace(offset, bytes.size(), bytes);
  };
  const auto putWhole = [&](std::size_t offset, std::size_t i, std::int64_t value) {
    first ? put(offset + 2 * i, static_cast<std::int16_t>(value)) : put(offset + 8 * i, value);
  };
  const auto putReal = [&](std::size_t offset, std::size_t i, double value) {
    first ? put(offset + 4 * i, static_cast<float>(value)) : put(offset + 8 * i, value);
  };
  const auto putCode = [&](std::size_t offset, int value) {
    first ? put(offset, static_cast<std::int16_t>(value)) : put(offset, static_cast<std::int32_t>(value));
  };
  put(0, first ? std::int32_t{348} : std::int32_t{540});
  header.replace(first ? 344 : 4, 3, first ? "n+1" : "n+2");
  if (!first) header.replace(8, 4, "\r\n\032\n");
  putWhole(first ? 40 : 16, 0, 3);
  for (std::size_t i = 1; i < 8; ++i) putWhole(first ? 40 : 16, i, i <= 3 ? file.size[i - 1] : 1);
  put(first ? 70 : 12, file.datatype);
  for (std::size_t i = 0; i < 4; ++i) putReal(first ? 76 : 104, i, file.pixdim[i]);
  first ? put(108, 352.0F) : put(168, std::int64_t{544});
  putReal(first ? 112 : 176, 0, file.slope);
  putReal(first ? 112 : 176, 1, file.intercept);
  first ? put(123, static_cast<std::uint8_t>(file.units)) : put(500, static_cast<std::int32_t>(file.units));
  putCode(first ? 252 : 344, file.qform_code);
  putCode(first ? 254 : 348, file.sform_code);
  for (std::size_t i = 0; i < 6; ++i) putReal(first ? 256 : 352, i, file.quatern[i]);
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t i = 0; i < 4; ++i) putReal(first ? 280 : 400, 4 * row + i, file.srow[row][i]);
  }
  return header + file.voxels;
}

}  // namespace test_files
}  // namespace xray_registration
