#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "tools/benchmark/growth.h"
#include "tools/evaluate/panel.h"

namespace xray_registration::tools {
namespace {

constexpr int kPanelWidth = 560;
constexpr int kPanelHeight = 420;

struct Point {
  double size;
  double ms;
};

/// The rows <prefix><number>/<what>, in their order.
std::vector<Point> curveOf(const std::vector<BenchmarkRow>& rows, const std::string& prefix, const std::string& what) {
  std::vector<Point> curve;
  for (const BenchmarkRow& row : rows) {
    if (row.name.rfind(prefix, 0) != 0) continue;
    char* rest = nullptr;
    const double size = std::strtod(row.name.c_str() + prefix.size(), &rest);
    if (rest == "/" + what) curve.push_back({size, row.milliseconds_median});
  }
  return curve;
}

struct Curve {
  std::string what;
  std::string label;
  cv::Scalar colour;
};

void drawPanel(cv::Mat* picture, int column, const std::string& title, const Panel::Axis& x,
               const std::vector<BenchmarkRow>& rows, const std::string& prefix, const std::vector<Curve>& curves) {
  double low = 1e9;
  double high = 1e-9;
  for (const Curve& curve : curves) {
    for (const Point& point : curveOf(rows, prefix, curve.what)) {
      low = std::min(low, point.ms);
      high = std::max(high, point.ms);
    }
  }
  if (low > high) return;
  Panel::Axis y{"ms", std::pow(10.0, std::floor(std::log10(low))), std::pow(10.0, std::ceil(std::log10(high))), true};
  if (!x.logarithmic) y = {"ms", 0.0, 1.3 * high, false};
  Panel panel(picture, {column * kPanelWidth, 0, kPanelWidth, kPanelHeight}, title, x, y);
  for (const Curve& curve : curves) {
    const std::vector<Point> points = curveOf(rows, prefix, curve.what);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (i > 0) panel.line(points[i - 1].size, points[i - 1].ms, points[i].size, points[i].ms, curve.colour, 2);
      panel.dot(points[i].size, points[i].ms, curve.colour, 4);
      // The two curves over sizes lie too close for two rows of numbers.
      if (x.logarithmic && &curve != &curves.front()) continue;
      char value[32];
      std::snprintf(value, sizeof value, "%.3g", points[i].ms);
      // Above the line, which rises to the right.
      const double above = x.logarithmic ? 1.2 * points[i].ms : points[i].ms + 0.05 * high;
      panel.text(points[i].size, above, value, curve.colour);
    }
    panel.legend(curve.label, curve.colour);
  }
}

}  // namespace

void drawGrowth(const std::string& path, const std::vector<BenchmarkRow>& rows) {
  cv::Mat picture(kPanelHeight, 3 * kPanelWidth, CV_8UC3, cv::Scalar(255, 255, 255));
  const Curve step{"step", "one Gauss-Newton step", {90, 150, 40}};
  const Curve drr{"drr", "one DRR", {190, 110, 40}};
  const Curve frame{"frame", "a tracked frame", {50, 50, 200}};
  drawPanel(&picture, 0, "CT of N^3 voxels, image 256^2", {"N", 40.0, 800.0, true}, rows, "growth/ct/", {step, drr});
  drawPanel(&picture, 1, "Image of N^2 pixels, CT 256^3", {"N", 40.0, 1600.0, true}, rows, "growth/image/",
            {step, drr});
  drawPanel(&picture, 2, "Views of 256^2, CT 256^3", {"views", 0.0, 5.0, false}, rows, "growth/views/", {step, frame});
  if (!cv::imwrite(path, picture)) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace xray_registration::tools
