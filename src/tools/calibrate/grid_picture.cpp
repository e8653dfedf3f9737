#include "tools/calibrate/grid_picture.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tools/calibrate/arrow_panel.h"
#include "tools/common/image_files.h"
#include "xray_registration/image/xray_frame.h"

namespace xray_registration::tools {
namespace {

const cv::Scalar kUsed(90, 220, 60);
const cv::Scalar kLeftOut(60, 60, 255);
/// Of the grid's pitch: about how long an arrow of the mean length is drawn.
constexpr double kArrowLength = 0.6;

/// Where marks are, and where they belong.
struct Marks {
  std::vector<Eigen::Vector2d> are;
  std::vector<Eigen::Vector2d> belong;
};

void drawLines(const CalibrationGrid& grid, const std::vector<Eigen::Vector2d>& places, ArrowPanel* panel) {
  std::map<std::pair<int, int>, std::size_t> marks;
  for (std::size_t i = 0; i < grid.marks.size(); ++i) marks[{grid.marks[i].cell.x(), grid.marks[i].cell.y()}] = i;
  for (const auto& [cell, mark] : marks) {
    for (const auto& [i, j] : {std::make_pair(1, 0), std::make_pair(0, 1)}) {
      const auto neighbour = marks.find({cell.first + i, cell.second + j});
      if (neighbour != marks.end()) panel->drawLine(places[mark], places[neighbour->second]);
    }
  }
}

void drawMarks(const Marks& marks, const std::vector<bool>& used, double factor, ArrowPanel* panel) {
  for (std::size_t i = 0; i < marks.are.size(); ++i) {
    if (used[i]) panel->drawMotion(marks.belong[i], marks.are[i] - marks.belong[i], factor);
    panel->drawDot(marks.are[i], used[i] ? kUsed : kLeftOut);
  }
}

std::string caption(const char* when, const PixelResidual& residual, double factor) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%s: rms %.3f px, largest %.3f px; arrows x %g", when, residual.rms_px,
                residual.max_px, factor);
  return text.data();
}

/// The picture on its way through the node, but for its grey values, which stay.
XrayFrame straightened(const FloatImage& picture, const UndistortionMap& map) {
  Calibration calibration;
  calibration.width = picture.width;
  calibration.height = picture.height;
  calibration.k = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  LinearizeOptions as_it_is;
  as_it_is.kind = ImageKind::kAttenuation;
  return makeXrayFrame(picture, 0.0, calibration, as_it_is, nullptr, std::make_shared<const UndistortionMap>(map));
}

}  // namespace

void drawGrid(const std::string& path, const FloatImage& picture, const GridCalibration& found) {
  Marks before;
  Marks after;
  for (const GridMark& mark : found.grid.marks) {
    before.are.push_back(mark.raw);
    before.belong.push_back(mark.straight);
    // To first order what is left over is the same length in both pictures.
    after.are.emplace_back(mark.straight + mark.raw - found.map.rawPixel(mark.straight));
    after.belong.push_back(mark.straight);
  }
  const auto panel = [&](const char* when, const FloatImage& pixels, const MaskImage& seen, const Marks& marks,
                         const PixelResidual& residual) {
    ArrowPanel drawn(pixels);
    if (!seen.empty()) drawn.darken(seen);
    const double factor = roundFactor(kArrowLength * found.grid.pitch_px / std::max(residual.rms_px, 1e-6));
    drawLines(found.grid, marks.are, &drawn);
    drawMarks(marks, found.fit.used, factor, &drawn);
    return drawn.captioned(caption(when, residual, factor));
  };
  const XrayFrame straight = straightened(picture, found.map);
  cv::Mat both;
  cv::hconcat(panel("before", picture, {}, before, found.fit.before),
              panel("after", straight.attenuation.values(), straight.mask, after, found.fit.after), both);
  writePng(path, both);
}

}  // namespace xray_registration::tools
