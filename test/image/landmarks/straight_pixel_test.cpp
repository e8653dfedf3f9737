#include "xray_registration/image/straight_pixel.h"

#include <gtest/gtest.h>

#include <cmath>

namespace xray_registration {
namespace {

// The inverse of what makeXrayFrame does; its own table is in float.
constexpr double kTolerance_px = 0.005;

Calibration calibrated() {
  Calibration c;
  c.width = 400;
  c.height = 320;
  c.k = {900, 0, 195, 0, 905, 162, 0, 0, 1};
  return c;
}

UndistortionMap pincushion() {
  std::vector<PixelPair> points;
  for (int v = 0; v <= 320; v += 20) {
    for (int u = 0; u <= 400; u += 20) {
      const Eigen::Vector2d straight(u, v);
      const Eigen::Vector2d from_middle = straight - Eigen::Vector2d(200, 160);
      points.push_back({straight + 3e-7 * from_middle.squaredNorm() * from_middle, straight});
    }
  }
  return UndistortionMap::fitted(400, 320, points);
}

/// Every tenth pixel of the straight image, through makeXrayFrame's table and back.
void expectInverse(const Calibration& c, int width, int height, const std::shared_ptr<const UndistortionMap>& map,
                   double least_bent_px) {
  FloatImage raw(width, height, 100.0F);
  raw.at(0, 0) = 50.0F;
  StraightenedPixels pixels;
  makeXrayFrame(raw, 65535.0, c, {}, &pixels, map);
  double most_bent = 0.0;
  for (int v = 5; v < height; v += 10) {
    for (int u = 5; u < width; u += 10) {
      const Eigen::Vector2d shown(pixels.source_u.at(u, v), pixels.source_v.at(u, v));
      const Eigen::Vector2d straight = straightPixel(shown, c, map.get());
      EXPECT_NEAR(straight.x(), u, kTolerance_px);
      EXPECT_NEAR(straight.y(), v, kTolerance_px);
      most_bent = std::max(most_bent, (shown - Eigen::Vector2d(u, v)).norm());
    }
  }
  EXPECT_GT(most_bent, least_bent_px);
}

TEST(StraightPixel, IsTheSameWithoutDistortion) {
  const Eigen::Vector2d pixel(12.25, 300.5);
  EXPECT_LT((straightPixel(pixel, calibrated()) - pixel).norm(), 1e-9);
}

TEST(StraightPixel, UndoesALens) {
  Calibration c = calibrated();
  c.distortion_model = "plumb_bob";
  c.distortion = {0.2, -0.3, 0.002, -0.001, 0.1};
  expectInverse(c, 400, 320, nullptr, 1.0);
}

TEST(StraightPixel, UndoesADetector) {
  expectInverse(calibrated(), 400, 320, std::make_shared<const UndistortionMap>(pincushion()), 3.0);
}

TEST(StraightPixel, UndoesBothInABinnedWindow) {
  Calibration c = calibrated();
  c.distortion_model = "plumb_bob";
  c.distortion = {0.2, 0.0, 0.0, 0.0};
  c.binning_x = c.binning_y = 2;
  c.roi_x = 60;
  c.roi_y = 20;
  c.roi_width = 300;
  c.roi_height = 240;
  expectInverse(c, 150, 120, std::make_shared<const UndistortionMap>(pincushion()), 1.0);
  EXPECT_EQ(cameraOf(c).width, 150);
  EXPECT_EQ(cameraOf(c).height, 120);
}

TEST(StraightPixel, RefusesACameraThatIsNone) {
  Calibration c = calibrated();
  c.k[0] = 0.0;
  EXPECT_THROW(straightPixel({1, 1}, c), FrameError);
  c = calibrated();
  c.width = 0;
  EXPECT_THROW(cameraOf(c), FrameError);
}

}  // namespace
}  // namespace xray_registration
