#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

// What the readers of files hand on, in plain types: ITK's headers carry an Eigen of their own, which clashes with the
// project's in one translation unit. Lengths in mm, frame LPS.

namespace xray_registration {

struct FileGrid {
  std::array<int, 3> size{};
  std::array<double, 3> spacing_mm{1.0, 1.0, 1.0};
  std::array<double, 3> origin_mm{};
  std::array<std::array<double, 3>, 3> axes{};  ///< axes[i]: direction of index i.

  std::size_t voxelCount() const {
    return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]);
  }
};

/// What the caller says of a file: how its numbers and lengths are to be understood.
struct FileRule {
  double slope = 1.0;  ///< HU = slope · value + intercept, where value is what the file states.
  double intercept = 0.0;
  std::optional<double> padding;  ///< This value in the file marks voxels without a value.
  double unit_mm = 0.0;           ///< Length of the file's unit; 0: as the file says.
  std::string orientation;        ///< Where the file's axes point when it does not say, e.g. RAS; empty: by its format.
  std::string directory;          ///< When set, files that the file refers to must lie below this folder.
};

/// The numbers of a file, after its own rescaling and before the caller's.
struct ValueFacts {
  double low = std::numeric_limits<double>::infinity();  ///< Of the finite ones that are no padding.
  double high = -std::numeric_limits<double>::infinity();
  std::size_t not_finite = 0;
  std::size_t padded = 0;
  bool eight_bits = false;

  void add(const ValueFacts& other) {
    low = std::fmin(low, other.low);
    high = std::fmax(high, other.high);
    not_finite += other.not_finite;
    padded += other.padded;
    eight_bits = eight_bits || other.eight_bits;
  }
};

template <typename T>
struct FileImage {
  FileGrid grid;
  std::vector<T> voxels;
  ValueFacts facts;
  std::string format;                 ///< In words: format, type of the numbers, where the orientation was found.
  std::vector<std::string> warnings;  ///< What was not stated or contradicts itself, and what was made of it.
};

}  // namespace xray_registration
