#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <vector>

#include "xray_registration/image/image.h"

namespace xray_registration {

/// Why a picture shows no grid that a calibration can stand on, in words.
class GridError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class GridKind {
  kSquare,     ///< Four neighbours at right angles.
  kHexagonal,  ///< Six neighbours, as holes are drilled closest to each other.
};

/// A mark of the grid that was found. Pixels of the picture; integers are pixel centres.
struct GridMark {
  Eigen::Vector2i cell;  ///< Which one: steps along the grid's two axes (at 90° or 60°) from the middle of the picture.
  Eigen::Vector2d raw;       ///< Where the picture shows it.
  Eigen::Vector2d straight;  ///< Where an undistorted picture would.
};

/// A regular grid in a picture.
struct CalibrationGrid {
  GridKind kind = GridKind::kSquare;
  bool bright_marks = false;    ///< Holes, or the cells of a wire mesh; else beads.
  double pitch_px = 0.0;        ///< Distance of neighbours in the middle of the picture.
  double filled_share = 0.0;    ///< Marks found, of those that the area they cover has room for.
  std::vector<GridMark> marks;  ///< From the middle of the picture outwards.
};

/// Finds beads on a bright ground, holes in a dark one, or a wire mesh: neither polarity, pitch, size nor orientation
/// need be known. Marks may be missing, the field may be round, the picture distorted by as much as lets neighbouring
/// cells look alike. Only ratios of intensities count, so shading does no harm.
///
/// The straight grid is the one that the middle of the picture shows: a similarity has its position, mean scale and
/// orientation there, and all that deviates from it elsewhere is distortion. So a camera's K keeps its meaning. The
/// plate must stand parallel to the detector's face, best on it: perspective would be taken for distortion.
/// @param picture  Intensities, any scale; not negative.
/// @throws GridError when there is no grid, or more than one could be meant.
CalibrationGrid findCalibrationGrid(const FloatImage& picture);

}  // namespace xray_registration
