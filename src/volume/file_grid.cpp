#include "file_grid.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "xray_registration/volume/volume_error.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration {
namespace {

// Larger than any CT; a broken header must not make the machine run out of memory.
constexpr double kMaxVoxels = 2147483647.0;
// Of the dot product of two axes: about 0.06 degrees. Files store axes as rounded numbers.
constexpr double kAxesTolerance = 1e-3;
// A body scan from head to foot is 2 m long, a scan of a finger's joint a few mm.
constexpr double kLongest_mm = 5000.0;
constexpr double kShortest_mm = 0.5;
constexpr double kFinest_mm = 1e-4;  // Of a voxel: a tenth of what an X-ray microscope sees.

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw VolumeError("'" + path + "': " + what);
}

// The axis of LPS (0, 1, 2) that a letter belongs to, and whether it points the other way; -1 for no such letter.
int axisOf(char letter, bool* reversed) {
  for (int axis = 0; axis < 3; ++axis) {
    if (letter == "LPS"[axis] || letter == "RAI"[axis]) {
      *reversed = letter == "RAI"[axis];
      return axis;
    }
  }
  return -1;
}

}  // namespace

bool isOrientation(const std::string& letters) {
  if (letters.size() != 3) return false;
  int seen = 0;
  for (const char letter : letters) {
    bool reversed = false;
    const int axis = axisOf(letter, &reversed);
    if (axis >= 0) seen |= 1 << axis;
  }
  return seen == 7;
}

void checkOrientation(const std::string& letters) {
  if (isOrientation(letters)) return;
  throw VolumeError("ct/orientation is '" + letters +
                    "': it must be three letters that say where x, y and z point, one each of L or R, P or A, S or I; "
                    "for example RAS");
}

void turnToLps(const std::string& letters, FileGrid* grid) {
  const auto turned = [&letters](const std::array<double, 3>& vector) {
    std::array<double, 3> result{};
    for (std::size_t i = 0; i < 3; ++i) {
      bool reversed = false;
      const auto axis = static_cast<std::size_t>(axisOf(letters[i], &reversed));
      // Not -0.0, which would be shown.
      result[axis] = reversed ? 0.0 - vector[i] : vector[i];
    }
    return result;
  };
  grid->origin_mm = turned(grid->origin_mm);
  for (auto& axis : grid->axes) axis = turned(axis);
}

void checkGrid(const FileGrid& grid, const std::string& path) {
  double voxels = 1.0;
  for (const int size : grid.size) voxels *= size;
  if (voxels > kMaxVoxels || voxels < 1.0)
    refuse(path, "its header states an impossible number of voxels: it is damaged; copy it from its source again");
  for (std::size_t i = 0; i < 3; ++i) {
    if (grid.size[i] < 2) refuse(path, "it is one voxel thin along an axis");
    if (!(grid.spacing_mm[i] > 0.0 && std::isfinite(grid.spacing_mm[i]))) {
      refuse(path, "it states a voxel size that is not positive: write it anew with the right one");
    }
    if (!std::isfinite(grid.origin_mm[i])) refuse(path, "its origin is no number: write it anew with the right one");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      double dot = 0.0;
      for (std::size_t k = 0; k < 3; ++k) dot += grid.axes[i][k] * grid.axes[j][k];
      if (!(std::abs(dot - (i == j ? 1.0 : 0.0)) < kAxesTolerance)) {
        refuse(path, "its axes are not at right angles (sheared, as with gantry tilt); resample it first");
      }
    }
  }
}

void scaleLengths(double unit_mm, const std::string& path, FileGrid* grid) {
  for (double& spacing : grid->spacing_mm) spacing *= unit_mm;
  for (double& coordinate : grid->origin_mm) coordinate *= unit_mm;
  double longest_mm = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    longest_mm = std::max(longest_mm, grid->spacing_mm[i] * grid->size[i]);
  }
  const double finest_mm = *std::min_element(grid->spacing_mm.begin(), grid->spacing_mm.end());
  const bool is_too_fine = finest_mm < kFinest_mm;
  if (longest_mm <= kLongest_mm && longest_mm >= kShortest_mm && !is_too_fine) return;
  std::ostringstream text;
  text << (is_too_fine ? "its voxels would be " : "its longest side would be ")
       << (is_too_fine ? finest_mm : longest_mm) << (is_too_fine ? " mm thin" : " mm long")
       << "; say in ct/unit_mm how many millimetres the unit of its lengths has (0.001 for micrometres, 1000 "
          "for metres)";
  refuse(path, text.str());
}

}  // namespace xray_registration
