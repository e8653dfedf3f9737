#include "xray_registration/geometry/xray_camera.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

XrayCamera camera() { return {256, 200, 1500.0, 1480.0, 127.0, 96.5}; }

TEST(XrayCamera, ProjectionAndRayAreInverse) {
  const Eigen::Vector3d point(12.0, -30.0, 870.0);
  const Eigen::Vector2d pixel = camera().project(point);
  EXPECT_LT((camera().rayDirection(pixel.x(), pixel.y()) * point.z() - point).norm(), 1e-10);
}

TEST(XrayCamera, BinnedCameraSeesThePixelCentresOfBlocks) {
  const XrayCamera binned = camera().binned(4);
  EXPECT_EQ(binned.width, 64);
  EXPECT_EQ(binned.height, 50);
  // The centre of the block of pixels 4…7 is 5.5.
  EXPECT_LT((binned.rayDirection(1.0, 1.0) - camera().rayDirection(5.5, 5.5)).norm(), 1e-15);
}

TEST(XrayCamera, CroppedCameraSeesTheSameRays) {
  EXPECT_LT((camera().cropped(10, 20, 30, 40).rayDirection(3, 4) - camera().rayDirection(13, 24)).norm(), 1e-15);
}

TEST(XrayCamera, SaysWhatIsWrong) {
  EXPECT_STREQ(camera().problem(), "");
  XrayCamera bad = camera();
  bad.fx = 0.0;
  EXPECT_STRNE(bad.problem(), "");
  bad = camera();
  bad.height = 0;
  EXPECT_STRNE(bad.problem(), "");
}

}  // namespace
}  // namespace xray_registration
