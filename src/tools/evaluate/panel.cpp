#include "tools/evaluate/panel.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace xray_registration::tools {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kFontScale = 0.42;
constexpr int kLeft = 62;
constexpr int kRight = 18;
constexpr int kTop = 34;
constexpr int kBottom = 50;

cv::Scalar ink() { return {40, 40, 40}; }
cv::Scalar gridGrey() { return {225, 225, 225}; }

std::string shortNumber(double value) {
  char digits[32];
  std::snprintf(digits, sizeof digits, "%g", value);
  return digits;
}

int widthOf(const std::string& words) { return cv::getTextSize(words, kFont, kFontScale, 1, nullptr).width; }

void put(cv::Mat* picture, const std::string& words, const cv::Point& at, const cv::Scalar& colour) {
  cv::putText(*picture, words, at, kFont, kFontScale, colour, 1, cv::LINE_AA);
}

/// 1, 2 or 5 times a power of ten, so that about five ticks fit.
double tickStep(double span) {
  const double rough = span / 5.0;
  const double decade = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (rough <= factor * decade * 1.0001) return factor * decade;
  }
  return 10.0 * decade;
}

std::vector<double> ticks(const Panel::Axis& axis) {
  std::vector<double> values;
  if (axis.logarithmic) {
    const int last = static_cast<int>(std::floor(std::log10(axis.high) + 1e-9));
    for (int decade = static_cast<int>(std::ceil(std::log10(axis.low) - 1e-9)); decade <= last; ++decade) {
      values.push_back(std::pow(10.0, decade));
    }
    return values;
  }
  const double step = tickStep(axis.high - axis.low);
  const int last = static_cast<int>(std::floor(axis.high / step + 1e-9));
  for (int i = static_cast<int>(std::ceil(axis.low / step - 1e-9)); i <= last; ++i) values.push_back(i * step);
  return values;
}

}  // namespace

Panel::Panel(cv::Mat* picture, const cv::Rect& area, const std::string& title, const Axis& x, const Axis& y)
    : picture_(picture),
      plot_(area.x + kLeft, area.y + kTop, area.width - kLeft - kRight, area.height - kTop - kBottom),
      x_(x),
      y_(y) {
  drawTicks(x_, true);
  drawTicks(y_, false);
  cv::rectangle(*picture_, plot_, ink(), 1);
  put(picture_, title, {plot_.x, area.y + 20}, ink());
  put(picture_, x_.name, {plot_.x + (plot_.width - widthOf(x_.name)) / 2, area.y + area.height - 12}, ink());
  // OpenCV writes no upright text: the y axis is named above its upper end, at the right.
  put(picture_, y_.name, {plot_.x + plot_.width - widthOf(y_.name), area.y + 20}, ink());
}

double Panel::share(const Axis& axis, double value) const {
  if (std::isnan(value)) return 1.0;
  const double clamped = std::min(std::max(value, axis.low), axis.high);
  if (axis.logarithmic) return std::log(clamped / axis.low) / std::log(axis.high / axis.low);
  return (clamped - axis.low) / (axis.high - axis.low);
}

cv::Point Panel::at(double x, double y) const {
  return {plot_.x + static_cast<int>(std::lround(share(x_, x) * plot_.width)),
          plot_.y + static_cast<int>(std::lround((1.0 - share(y_, y)) * plot_.height))};
}

void Panel::drawTicks(const Axis& axis, bool horizontal) {
  for (const double value : ticks(axis)) {
    const std::string label = shortNumber(value);
    const cv::Point low = horizontal ? at(value, y_.low) : at(x_.low, value);
    const cv::Point high = horizontal ? at(value, y_.high) : at(x_.high, value);
    cv::line(*picture_, low, high, gridGrey(), 1);
    const cv::Point corner = horizontal ? cv::Point(low.x - widthOf(label) / 2, low.y + 18)
                                        : cv::Point(low.x - widthOf(label) - 7, low.y + 4);
    put(picture_, label, corner, ink());
  }
}

void Panel::dot(double x, double y, const cv::Scalar& colour, int radius) {
  cv::circle(*picture_, at(x, y), radius, colour, cv::FILLED, cv::LINE_AA);
}

void Panel::line(double x0, double y0, double x1, double y1, const cv::Scalar& colour, int thickness) {
  cv::line(*picture_, at(x0, y0), at(x1, y1), colour, thickness, cv::LINE_AA);
}

void Panel::bar(double x0, double x1, double height, const cv::Scalar& colour) {
  const cv::Point low = at(x0, y_.low);
  const cv::Point high = at(x1, height);
  cv::rectangle(*picture_, cv::Point(low.x + 1, high.y), cv::Point(high.x - 1, low.y - 1), colour, cv::FILLED);
}

void Panel::text(double x, double y, const std::string& words, const cv::Scalar& colour) {
  const cv::Point point = at(x, y);
  put(picture_, words, {point.x - widthOf(words) / 2, point.y - 4}, colour);
}

void Panel::legend(const std::string& words, const cv::Scalar& colour, bool lower_right) {
  constexpr int kLineHeight = 16;
  const cv::Point upper(plot_.x + 8, plot_.y + kLineHeight * (1 + legend_lines_));
  const cv::Point lower(plot_.x + plot_.width - widthOf(words) - 8,
                        plot_.y + plot_.height - 8 - kLineHeight * legend_lines_);
  put(picture_, words, lower_right ? lower : upper, colour);
  ++legend_lines_;
}

}  // namespace xray_registration::tools
