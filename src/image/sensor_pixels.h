#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "xray_registration/image/xray_frame.h"

namespace xray_registration {

/// Frame pixels against the whole sensor's: ROI and binning.
class SensorPixels {
 public:
  explicit SensorPixels(const Calibration& c)
      : origin_(c.roi_x, c.roi_y), binning_(std::max(1, c.binning_x), std::max(1, c.binning_y)) {}

  /// Edges scale; centres lie half a pixel inside.
  Eigen::Vector2d sensor(const Eigen::Vector2d& frame) const {
    return ((frame.array() + 0.5) * binning_ - 0.5 + origin_).matrix();
  }
  Eigen::Vector2d frame(const Eigen::Vector2d& sensor) const {
    return ((sensor.array() - origin_ + 0.5) / binning_ - 0.5).matrix();
  }

 private:
  Eigen::Array2d origin_;
  Eigen::Array2d binning_;
};

}  // namespace xray_registration
