#include "xray_registration/image/straight_pixel.h"

#include <opencv2/calib3d.hpp>
#include <vector>

#include "image/sensor_pixels.h"

namespace xray_registration {
namespace {

constexpr int kMostRounds = 100;
constexpr double kClose_px = 1e-4;

/// The map goes from straight to raw, and bends little from one pixel to the next.
Eigen::Vector2d throughDetector(const Eigen::Vector2d& raw, const Calibration& calibration,
                                const UndistortionMap& map) {
  const SensorPixels window(calibration);
  const Eigen::Vector2d raw_sensor = window.sensor(raw);
  Eigen::Vector2d straight = raw_sensor;
  for (int round = 0; round < kMostRounds; ++round) {
    const Eigen::Vector2d off = raw_sensor - map.rawPixel(straight);
    straight += off;
    if (off.norm() < kClose_px) break;
  }
  return window.frame(straight);
}

}  // namespace

XrayCamera cameraOf(const Calibration& calibration) {
  const bool is_whole = calibration.roi_width == 0 && calibration.roi_height == 0;
  const int width = is_whole ? calibration.width : calibration.roi_width;
  const int height = is_whole ? calibration.height : calibration.roi_height;
  return cameraFromCalibration(calibration, width / std::max(1, calibration.binning_x),
                               height / std::max(1, calibration.binning_y));
}

Eigen::Vector2d straightPixel(const Eigen::Vector2d& raw, const Calibration& calibration, const UndistortionMap* map) {
  const XrayCamera camera = cameraOf(calibration);
  const Eigen::Vector2d pixel = map == nullptr ? raw : throughDetector(raw, calibration, *map);
  const cv::Matx33d k(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
  const std::vector<cv::Point2d> distorted = {{pixel.x(), pixel.y()}};
  std::vector<cv::Point2d> straight;
  cv::undistortPoints(distorted, straight, k, calibration.distortion, cv::noArray(), k,
                      cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, kMostRounds, kClose_px));
  return {straight.front().x, straight.front().y};
}

}  // namespace xray_registration
