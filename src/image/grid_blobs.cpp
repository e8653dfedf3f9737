#include "image/grid_blobs.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "xray_registration/common/statistics.h"

namespace xray_registration {
namespace grid_detail {
namespace {

/// Of the two Gaussians whose difference is a band-pass.
constexpr double kWiderGaussian = 1.6;
/// Nearer to the picture's border than this many sigmas a spot's surroundings are cut.
constexpr double kRim = 3.2;
/// Steeper than this share of itself over four sigmas the ground has an edge.
constexpr double kSteep = 0.2;
/// Of the Gaussian that says how bright the surroundings are.
constexpr double kGroundGaussian = 4.0;
/// Below this share of the brightest the ground is dark: noise there is not magnified further.
constexpr double kDarkGround = 0.02;
/// Spots weaker than this share of the strong ones are none.
constexpr double kWeakest = 0.3;
constexpr double kStrongRank = 0.9;
/// Fainter than noise in any X-ray; on flat ground it is rounding.
constexpr double kFaintest = 2e-3;

cv::Mat blurred(const cv::Mat& picture, double sigma_px) {
  cv::Mat result;
  cv::GaussianBlur(picture, result, cv::Size(), sigma_px, sigma_px, cv::BORDER_REPLICATE);
  return result;
}

/// Offset of a parabola's vertex from the middle of three values at -1, 0, 1.
double vertex(float before, float middle, float after) {
  const double curvature = 2.0 * middle - before - after;
  if (curvature <= 0.0) return 0.0;
  return std::min(std::max(0.5 * (after - before) / curvature, -0.5), 0.5);
}

bool isAtAnEdge(const ScaledPicture& picture, const cv::Point& at) {
  const int reach = static_cast<int>(std::lround(2.0 * picture.sigma_px));
  const auto ground = [&](int du, int dv) { return picture.ground.at<float>(at.y + dv, at.x + du); };
  const float across = ground(reach, 0) - ground(-reach, 0);
  const float down = ground(0, reach) - ground(0, -reach);
  return std::hypot(across, down) > kSteep * ground(0, 0);
}

struct Peak {
  cv::Point at;
  float height;
};

std::vector<Peak> peaksOf(const cv::Mat& contrast, double sigma_px) {
  const int reach = std::max(1, static_cast<int>(std::lround(sigma_px)));
  cv::Mat highest;
  cv::dilate(contrast, highest, cv::getStructuringElement(cv::MORPH_RECT, {2 * reach + 1, 2 * reach + 1}));
  // A spot in the middle between pixels has several that are equally high: the first one counts.
  cv::Mat taken = cv::Mat::zeros(contrast.size(), CV_8U);
  const cv::Rect all({}, contrast.size());
  std::vector<Peak> peaks;
  for (int v = 1; v + 1 < contrast.rows; ++v) {
    for (int u = 1; u + 1 < contrast.cols; ++u) {
      const float value = contrast.at<float>(v, u);
      if (!(value > 0.0F && value == highest.at<float>(v, u)) || taken.at<std::uint8_t>(v, u) != 0) continue;
      peaks.push_back({{u, v}, value});
      taken(cv::Rect(u - reach, v - reach, 2 * reach + 1, 2 * reach + 1) & all).setTo(1);
    }
  }
  return peaks;
}

}  // namespace

ScaledPicture atScale(const cv::Mat& picture, double sigma_px) {
  double brightest = 0.0;
  cv::minMaxLoc(picture, nullptr, &brightest);
  const cv::Mat band = blurred(picture, sigma_px) - blurred(picture, kWiderGaussian * sigma_px);
  ScaledPicture scaled{sigma_px, {}, blurred(picture, kGroundGaussian * sigma_px) + kDarkGround * brightest};
  scaled.contrast = band / scaled.ground;
  return scaled;
}

std::vector<Spot> spotsOf(const ScaledPicture& picture, Polarity polarity) {
  const cv::Mat contrast = polarity == Polarity::kBright ? picture.contrast : cv::Mat(-picture.contrast);
  const std::vector<Peak> peaks = peaksOf(contrast, picture.sigma_px);
  if (peaks.empty()) return {};
  std::vector<float> heights;
  heights.reserve(peaks.size());
  for (const Peak& peak : peaks) heights.push_back(peak.height);
  const auto lowest = std::max<float>(kFaintest, kWeakest * quantileBelow(&heights, kStrongRank));
  const int rim = static_cast<int>(std::lround(kRim * picture.sigma_px));
  const cv::Rect inner(rim, rim, contrast.cols - 2 * rim, contrast.rows - 2 * rim);
  std::vector<Spot> spots;
  for (const Peak& peak : peaks) {
    if (peak.height < lowest || !inner.contains(peak.at) || isAtAnEdge(picture, peak.at)) continue;
    const auto value = [&](int du, int dv) { return contrast.at<float>(peak.at.y + dv, peak.at.x + du); };
    spots.push_back({{peak.at.x + vertex(value(-1, 0), value(0, 0), value(1, 0)),
                      peak.at.y + vertex(value(0, -1), value(0, 0), value(0, 1))},
                     peak.height});
  }
  return spots;
}

}  // namespace grid_detail
}  // namespace xray_registration
