#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "xray_registration/volume/volume_io.h"

// What the tests of reading CTs share.

namespace xray_registration {
namespace reading {

/// A CT and the warnings that came with it.
struct Read {
  Volume ct;
  std::string warned;
  std::string said;
};

inline Read read(const std::string& path, const VolumeReadOptions& options = {}) {
  Read result;
  result.ct = readVolume(path, options, [&result](LogLevel level, const std::string& text) {
    (level == LogLevel::kWarning ? result.warned : result.said) += text + "\n";
  });
  return result;
}

/// The exception's message, or what shows that there was none.
inline std::string refusal(const std::string& path, const VolumeReadOptions& options = {}) {
  try {
    readVolume(path, options, {});
  } catch (const VolumeError& error) {
    return error.what();
  }
  return "read without an error";
}

inline void expectContains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in: " << text;
}

/// Where a voxel lies, LPS in mm.
inline Eigen::Vector3d placeOf(const Volume& ct, double i, double j, double k) {
  return ct.grid.ctFromIndex() * Eigen::Vector3d(i, j, k);
}

inline void expectPlace(const Volume& ct, const Eigen::Vector3d& index, const Eigen::Vector3d& place_mm,
                        double tolerance_mm = 1e-4) {
  EXPECT_LT((ct.grid.ctFromIndex() * index - place_mm).norm(), tolerance_mm)
      << "voxel " << index.transpose() << " lies at " << (ct.grid.ctFromIndex() * index).transpose() << ", not at "
      << place_mm.transpose();
}

constexpr int kBodySide = 24;
constexpr int kBodySlices = 12;

/// A body as a scanner sees it, 24 x 24 x 12 voxels: noisy air near -1000 HU around fat, muscle and a bone.
inline std::vector<double> bodyHu() {
  std::vector<double> hu;
  unsigned noise = 1;
  for (int z = 0; z < kBodySlices; ++z) {
    for (int y = 0; y < kBodySide; ++y) {
      for (int x = 0; x < kBodySide; ++x) {
        const double radius = std::hypot(x - 11.5, y - 11.5);
        const double tissue = radius > 9.0 ? -1000.0 : radius > 7.5 ? -100.0 : radius > 2.5 ? 45.0 : 900.0;
        noise = noise * 1664525U + 1013904223U;
        hu.push_back(std::max(-1024.0, std::round(tissue + 12.0 * ((noise >> 16U) % 1000 / 500.0 - 1.0))));
      }
    }
  }
  return hu;
}

/// Numbers that were made of HU: slope * HU + intercept.
template <typename T>
std::vector<T> scaled(const std::vector<double>& hu, double slope = 1.0, double intercept = 0.0) {
  std::vector<T> numbers;
  for (const double value : hu) numbers.push_back(static_cast<T>(slope * value + intercept));
  return numbers;
}

/// Sets what lies outside of the circle that fits into a slice.
template <typename T>
void setOutside(T value, std::vector<T>* numbers) {
  for (std::size_t i = 0; i < numbers->size(); ++i) {
    const int x = static_cast<int>(i) % kBodySide;
    const int y = static_cast<int>(i) / kBodySide % kBodySide;
    if (std::hypot(x - 11.5, y - 11.5) > 11.6) (*numbers)[i] = value;
  }
}

}  // namespace reading
}  // namespace xray_registration
