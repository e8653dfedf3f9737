#include "tools/calibrate/arrow_panel.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "xray_registration/common/statistics.h"

namespace xray_registration::tools {
namespace {

const cv::Scalar kLine(200, 110, 30);
const cv::Scalar kArrow(0, 165, 255);
constexpr int kSmallestPanel = 1000;
constexpr int kCaption = 36;
/// cv::line's fractional bits.
constexpr int kShift = 4;

int enlargementOf(const FloatImage& picture) {
  const int longer = std::max(picture.width, picture.height);
  return std::max(1, (kSmallestPanel + longer - 1) / longer);
}

cv::Mat background(const FloatImage& picture, int enlarged) {
  cv::Mat grey(picture.height, picture.width, CV_32F, const_cast<float*>(picture.pixels.data()));
  std::vector<float> values = picture.pixels;
  const double low = quantileBelow(&values, 0.01);
  const double high = quantileBelow(&values, 0.99);
  const double scale = high > low ? 160.0 / (high - low) : 0.0;  // Not white, on which no arrow shows.
  cv::Mat small;
  grey.convertTo(small, CV_8U, scale, -scale * low);
  cv::cvtColor(small, small, cv::COLOR_GRAY2BGR);
  cv::Mat result;
  cv::resize(small, result, cv::Size(), enlarged, enlarged, cv::INTER_NEAREST);
  return result;
}

}  // namespace

double roundFactor(double factor) {
  if (!(factor > 1.0)) return 1.0;
  const double power = std::pow(10.0, std::floor(std::log10(factor)));
  for (const double digit : {5.0, 2.0}) {
    if (digit * power <= factor) return digit * power;
  }
  return power;
}

ArrowPanel::ArrowPanel(const FloatImage& picture)
    : enlarged_(enlargementOf(picture)), image_(background(picture, enlarged_)) {}

void ArrowPanel::darken(const MaskImage& seen) {
  cv::Mat mask(seen.height, seen.width, CV_8U, const_cast<std::uint8_t*>(seen.pixels.data()));
  cv::Mat large;
  cv::resize(mask, large, image_.size(), 0.0, 0.0, cv::INTER_NEAREST);
  cv::Mat dark = image_ * 0.4;
  dark.copyTo(image_, large == 0);
}

void ArrowPanel::drawLine(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  cv::line(image_, point(from), point(to), kLine, 1, cv::LINE_AA, kShift);
}

void ArrowPanel::drawDot(const Eigen::Vector2d& at, const cv::Scalar& colour) {
  cv::circle(image_, point(at), 3 << (kShift - 1), colour, cv::FILLED, cv::LINE_AA, kShift);
}

void ArrowPanel::drawMotion(const Eigen::Vector2d& from, const Eigen::Vector2d& motion, double factor) {
  cv::line(image_, point(from), point(from + factor * motion), kArrow, 1, cv::LINE_AA, kShift);
}

void ArrowPanel::drawArrow(const Eigen::Vector2d& from, const Eigen::Vector2d& motion, double factor) {
  cv::arrowedLine(image_, point(from), point(from + factor * motion), kArrow, 1, cv::LINE_AA, kShift, 0.3);
}

cv::Mat ArrowPanel::captioned(const std::string& text) const {
  cv::Mat result;
  cv::copyMakeBorder(image_, result, kCaption, 0, 4, 4, cv::BORDER_CONSTANT, cv::Scalar::all(0));
  cv::putText(result, text, {10, 25}, cv::FONT_HERSHEY_SIMPLEX, 0.6, cv::Scalar::all(255), 1, cv::LINE_AA);
  return result;
}

cv::Point ArrowPanel::point(const Eigen::Vector2d& pixel) const {
  const double unit = 1 << kShift;
  // Pixel centres of the enlarged picture.
  const Eigen::Vector2d at = ((pixel.array() + 0.5) * enlarged_ - 0.5).matrix();
  return {static_cast<int>(std::lround(unit * at.x())), static_cast<int>(std::lround(unit * at.y()))};
}

}  // namespace xray_registration::tools
