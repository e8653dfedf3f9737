#pragma once

#include <string>

#include "xray_registration/image/calibration_grid.h"
#include "xray_registration/image/undistortion_map.h"

namespace xray_registration::tools {

/// A grid that was found, and what was made of it.
struct GridCalibration {
  CalibrationGrid grid;
  UndistortionMap map;
  UndistortionFit fit;  ///< Of the grid's marks, in their order.
};

/// Draws a PNG with the picture beside the picture as the node will straighten it. In both: lines between neighbouring
/// marks (blue), marks that are used (green) and those that are not (red), and arrows from where a mark belongs to
/// where it is, longer than true by a factor that the caption states (orange). What the map does not cover is darker.
/// @throws std::runtime_error naming the file when it cannot be written.
void drawGrid(const std::string& path, const FloatImage& picture, const GridCalibration& found);

}  // namespace xray_registration::tools
