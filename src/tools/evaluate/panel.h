#pragma once

#include <opencv2/core.hpp>
#include <string>

namespace xray_registration::tools {

/// One diagram with its axes inside a picture. Values outside an axis are drawn at its end.
class Panel {
 public:
  struct Axis {
    std::string name;  ///< With its unit; ASCII, as OpenCV's fonts are.
    double low = 0.0;
    double high = 1.0;
    bool logarithmic = false;  ///< Ticks at the decades; `low` must be positive.
  };

  /// Draws frame, ticks and names into `area` of `picture` (8-bit BGR), which must outlive the panel.
  Panel(cv::Mat* picture, const cv::Rect& area, const std::string& title, const Axis& x, const Axis& y);

  cv::Point at(double x, double y) const;
  void dot(double x, double y, const cv::Scalar& colour, int radius = 3);
  void line(double x0, double y0, double x1, double y1, const cv::Scalar& colour, int thickness = 1);
  void bar(double x0, double x1, double height, const cv::Scalar& colour);
  void text(double x, double y, const std::string& words, const cv::Scalar& colour);
  /// Words in the panel's upper left corner, or lower right one, line by line.
  void legend(const std::string& words, const cv::Scalar& colour, bool lower_right = false);

 private:
  void drawTicks(const Axis& axis, bool horizontal);
  double share(const Axis& axis, double value) const;

  cv::Mat* picture_;
  cv::Rect plot_;
  Axis x_;
  Axis y_;
  int legend_lines_ = 0;
};

}  // namespace xray_registration::tools
