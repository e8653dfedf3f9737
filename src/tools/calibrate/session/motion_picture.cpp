#include "tools/calibrate/session/motion_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <opencv2/core.hpp>
#include <utility>

#include "tools/calibrate/arrow_panel.h"
#include "tools/common/image_files.h"
#include "xray_registration/common/statistics.h"

namespace xray_registration::tools {
namespace {

/// Cells along a picture's width that have an arrow: as many as windows in an image of 256 px.
constexpr int kCells = 16;
/// Of a cell: about how long a long arrow is drawn.
constexpr double kArrowLength = 1.2;

struct Arrow {
  Eigen::Vector2d at;
  Eigen::Vector2d motion;
};

std::vector<Arrow> arrowsOf(const std::vector<ResidualMotion>& all, std::size_t view, double cell_px) {
  std::map<std::pair<int, int>, std::array<std::vector<double>, 2>> cells;
  for (const ResidualMotion& one : all) {
    if (one.view != view) continue;
    const Eigen::Vector2d cell = (one.pixel / cell_px).array().floor();
    auto& motions = cells[{static_cast<int>(cell.x()), static_cast<int>(cell.y())}];
    for (int axis = 0; axis < 2; ++axis) motions[static_cast<std::size_t>(axis)].push_back(one.motion_px[axis]);
  }
  std::vector<Arrow> arrows;
  arrows.reserve(cells.size());
  for (const auto& [cell, motions] : cells) {
    arrows.push_back(
        {cell_px * Eigen::Vector2d(cell.first + 0.5, cell.second + 0.5), {median(motions[0]), median(motions[1])}});
  }
  return arrows;
}

double quantileOfLengths(const std::vector<Arrow>& arrows, double share) {
  std::vector<double> lengths;
  lengths.reserve(arrows.size());
  for (const Arrow& arrow : arrows) lengths.push_back(arrow.motion.norm());
  return quantile(lengths, share);
}

cv::Mat panel(const ViewInput& xray, const std::string& title, const std::vector<Arrow>& arrows, double factor) {
  ArrowPanel drawn(xray.xray->attenuation.values());
  for (const Arrow& arrow : arrows) drawn.drawArrow(arrow.at, arrow.motion, factor);
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(), "%s: median %.3f px, 95 %% below %.3f px; arrows x %g", title.c_str(),
                quantileOfLengths(arrows, 0.5), quantileOfLengths(arrows, 0.95), factor);
  return drawn.captioned(text.data());
}

}  // namespace

void drawResidualMotion(const std::string& path, const std::vector<ViewInput>& xrays,
                        const std::vector<std::string>& names, const GeometryCalibration& found) {
  std::vector<cv::Mat> rows;
  for (std::size_t view = 0; view < xrays.size(); ++view) {
    const double cell_px = static_cast<double>(xrays[view].xray->camera.width) / kCells;
    const std::vector<Arrow> before = arrowsOf(found.before, view, cell_px);
    const std::vector<Arrow> after = arrowsOf(found.after, view, cell_px);
    // One factor for both, or nobody sees that they became shorter.
    const double factor = roundFactor(kArrowLength * cell_px / std::max(quantileOfLengths(before, 0.95), 1e-6));
    const std::string name = names[view].empty() ? "" : names[view] + ", ";
    cv::Mat row;
    cv::hconcat(panel(xrays[view], name + "before", before, factor), panel(xrays[view], name + "after", after, factor),
                row);
    // Views of another size get a row of the same width.
    if (!rows.empty()) {
      cv::copyMakeBorder(row, row, 0, 0, 0, std::max(0, rows.front().cols - row.cols), cv::BORDER_CONSTANT);
      row = row(cv::Rect(0, 0, rows.front().cols, row.rows));
    }
    rows.push_back(row);
  }
  cv::Mat picture;
  cv::vconcat(rows, picture);
  writePng(path, picture);
}

}  // namespace xray_registration::tools
