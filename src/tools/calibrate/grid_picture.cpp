#include "tools/calibrate/grid_picture.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tools/common/image_files.h"
#include "xray_registration/common/statistics.h"
#include "xray_registration/image/xray_frame.h"

namespace xray_registration::tools {
namespace {

const cv::Scalar kLine(200, 110, 30);
const cv::Scalar kUsed(90, 220, 60);
const cv::Scalar kLeftOut(60, 60, 255);
const cv::Scalar kArrow(0, 165, 255);
/// Small pictures are drawn larger, so that lines and marks can be told apart.
constexpr int kSmallestPanel = 1000;
constexpr int kCaption = 36;
/// Of the grid's pitch: about how long an arrow of the mean length is drawn.
constexpr double kArrowLength = 0.6;
/// cv::line's fractional bits.
constexpr int kShift = 4;

/// Where marks are, and where they belong.
struct Marks {
  std::vector<Eigen::Vector2d> are;
  std::vector<Eigen::Vector2d> belong;
};

/// 1, 2, 5, 10, …, the largest below a number; at least 1.
double roundFactor(double factor) {
  if (!(factor > 1.0)) return 1.0;
  const double power = std::pow(10.0, std::floor(std::log10(factor)));
  for (const double digit : {5.0, 2.0}) {
    if (digit * power <= factor) return digit * power;
  }
  return power;
}

/// Grey values in colour, from the darkest to the brightest hundredth.
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

class Panel {
 public:
  Panel(const FloatImage& picture, int enlarged) : enlarged_(enlarged), image_(background(picture, enlarged)) {}

  void darken(const MaskImage& seen) {
    cv::Mat mask(seen.height, seen.width, CV_8U, const_cast<std::uint8_t*>(seen.pixels.data()));
    cv::Mat large;
    cv::resize(mask, large, image_.size(), 0.0, 0.0, cv::INTER_NEAREST);
    cv::Mat dark = image_ * 0.4;
    dark.copyTo(image_, large == 0);
  }

  void drawLines(const CalibrationGrid& grid, const std::vector<Eigen::Vector2d>& places) {
    std::map<std::pair<int, int>, std::size_t> marks;
    for (std::size_t i = 0; i < grid.marks.size(); ++i) marks[{grid.marks[i].cell.x(), grid.marks[i].cell.y()}] = i;
    for (const auto& [cell, mark] : marks) {
      for (const auto& [i, j] : {std::make_pair(1, 0), std::make_pair(0, 1)}) {
        const auto neighbour = marks.find({cell.first + i, cell.second + j});
        if (neighbour == marks.end()) continue;
        cv::line(image_, point(places[mark]), point(places[neighbour->second]), kLine, 1, cv::LINE_AA, kShift);
      }
    }
  }

  void drawMarks(const Marks& marks, const std::vector<bool>& used, double factor) {
    for (std::size_t i = 0; i < marks.are.size(); ++i) {
      const Eigen::Vector2d tip = marks.belong[i] + factor * (marks.are[i] - marks.belong[i]);
      if (used[i]) cv::line(image_, point(marks.belong[i]), point(tip), kArrow, 1, cv::LINE_AA, kShift);
      cv::circle(image_, point(marks.are[i]), 3 << (kShift - 1), used[i] ? kUsed : kLeftOut, cv::FILLED, cv::LINE_AA,
                 kShift);
    }
  }

  cv::Mat captioned(const std::string& text) const {
    cv::Mat result;
    cv::copyMakeBorder(image_, result, kCaption, 0, 4, 4, cv::BORDER_CONSTANT, cv::Scalar::all(0));
    cv::putText(result, text, {10, 25}, cv::FONT_HERSHEY_SIMPLEX, 0.6, cv::Scalar::all(255), 1, cv::LINE_AA);
    return result;
  }

 private:
  cv::Point point(const Eigen::Vector2d& pixel) const {
    const double unit = 1 << kShift;
    // Pixel centres of the enlarged picture.
    const Eigen::Vector2d at = ((pixel.array() + 0.5) * enlarged_ - 0.5).matrix();
    return {static_cast<int>(std::lround(unit * at.x())), static_cast<int>(std::lround(unit * at.y()))};
  }

  int enlarged_;
  cv::Mat image_;
};

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
    const int longer = std::max(picture.width, picture.height);
    Panel drawn(pixels, std::max(1, (kSmallestPanel + longer - 1) / longer));
    if (!seen.empty()) drawn.darken(seen);
    const double factor = roundFactor(kArrowLength * found.grid.pitch_px / std::max(residual.rms_px, 1e-6));
    drawn.drawLines(found.grid, marks.are);
    drawn.drawMarks(marks, found.fit.used, factor);
    return drawn.captioned(caption(when, residual, factor));
  };
  const XrayFrame straight = straightened(picture, found.map);
  cv::Mat both;
  cv::hconcat(panel("before", picture, {}, before, found.fit.before),
              panel("after", straight.attenuation, straight.mask, after, found.fit.after), both);
  writePng(path, both);
}

}  // namespace xray_registration::tools
