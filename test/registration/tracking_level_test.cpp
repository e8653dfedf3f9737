#include "registration/tracking_level.h"

#include <gtest/gtest.h>

#include <cmath>

namespace xray_registration {
namespace {

TEST(InPlaneSigma, IsTheMotionOfPointsAcrossTheView) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance(0, 0) = 0.09;
  covariance(1, 1) = 0.16;
  covariance(2, 2) = 100.0;  // Depth does not show.
  EXPECT_NEAR(inPlaneSigma(covariance, RigidTransform::Identity()), 0.5, 1e-12);
  covariance.setZero();
  covariance(5, 5) = 1e-4;  // A turn about the view's axis moves two of three axes' points.
  EXPECT_NEAR(inPlaneSigma(covariance, RigidTransform::Identity()), kTargetRadiusMm * 0.01 * std::sqrt(2.0 / 3.0),
              1e-9);
}

}  // namespace
}  // namespace xray_registration
