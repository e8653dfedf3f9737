#include "xray_registration/registration/pose_history.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

const Eigen::Vector3d kCentre{1.0, 2.0, 3.0};

RigidTransform at(double x_mm) {
  RigidTransform T = RigidTransform::Identity();
  T.translation().x() = x_mm;
  return T;
}

double xOf(const PoseHistory& history, double stamp_s, const PredictionLimits& limits = {}) {
  return history.predicted(stamp_s, kCentre, limits).translation().x();
}

TEST(PoseHistory, GoesOnWithConstantVelocity) {
  PoseHistory history;
  EXPECT_TRUE(history.empty());
  history.add(1.0, at(5.0));
  EXPECT_EQ(xOf(history, 2.0), 5.0);  // One pose has no velocity.
  history.add(1.1, at(6.0));
  EXPECT_NEAR(xOf(history, 1.2), 7.0, 1e-9);
  EXPECT_NEAR(xOf(history, 1.35), 8.5, 1e-9);
}

TEST(PoseHistory, VelocityIsBoundedAndDoesNotOutliveAGap) {
  PoseHistory history;
  history.add(1.0, at(0.0));
  history.add(1.1, at(100.0));
  PredictionLimits limits;
  limits.max_velocity_mm_s = 200.0;
  EXPECT_NEAR(xOf(history, 1.2, limits), 120.0, 1e-9);
  EXPECT_EQ(xOf(history, 1.1 + limits.max_gap_s + 0.1, limits), 100.0);
  EXPECT_EQ(xOf(history, 1.05, limits), 100.0);  // Backwards.
  history.forgetVelocity();
  EXPECT_EQ(xOf(history, 1.2, limits), 100.0);
  history.clear();
  EXPECT_TRUE(history.empty());
}

}  // namespace
}  // namespace xray_registration
