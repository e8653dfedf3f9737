#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

// Spots of one size. Private to this room.
namespace xray_registration {
namespace grid_detail {

/// A picture at one scale.
struct ScaledPicture {
  double sigma_px = 0.0;
  cv::Mat contrast;  ///< Relative to the ground; positive where it is brighter than around.
  cv::Mat ground;    ///< Brightness of the surroundings.
};

ScaledPicture atScale(const cv::Mat& picture, double sigma_px);

struct Spot {
  Eigen::Vector2d pixel;  ///< To a fraction of a pixel.
  double contrast = 0.0;
};

enum class Polarity { kBright, kDark };

/// Local extrema that stand out and are seen with their surroundings: not at the picture's border nor where the ground
/// is steep, as at the edge of a collimator, which would pull their places.
std::vector<Spot> spotsOf(const ScaledPicture& picture, Polarity polarity);

}  // namespace grid_detail
}  // namespace xray_registration
