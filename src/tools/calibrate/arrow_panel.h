#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"

namespace xray_registration::tools {

/// 1, 2, 5, 10, …, the largest below a number; at least 1.
double roundFactor(double factor);

/// A grey picture that lines and arrows are drawn on, in its own pixels.
class ArrowPanel {
 public:
  /// From the darkest to the brightest hundredth of the values. Small pictures are enlarged by a whole factor, so that
  /// lines and marks can be told apart.
  explicit ArrowPanel(const FloatImage& picture);

  /// Where the mask is 0.
  void darken(const MaskImage& seen);
  void drawLine(const Eigen::Vector2d& from, const Eigen::Vector2d& to);
  void drawDot(const Eigen::Vector2d& at, const cv::Scalar& colour);
  /// Longer than true by a factor. A bare line: the dots tell where it comes from.
  void drawMotion(const Eigen::Vector2d& from, const Eigen::Vector2d& motion, double factor);
  /// With a head.
  void drawArrow(const Eigen::Vector2d& from, const Eigen::Vector2d& motion, double factor);

  /// With a line of text above.
  cv::Mat captioned(const std::string& text) const;

 private:
  cv::Point point(const Eigen::Vector2d& pixel) const;

  int enlarged_;
  cv::Mat image_;
};

}  // namespace xray_registration::tools
