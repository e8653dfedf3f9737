#include "xray_registration/evaluation/pose_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace xray_registration {
namespace {

// Sums of 125 distances of magnitude up to 1e3 in double.
constexpr double kRounding = 1e-9;

RigidTransform somePose() {
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() = rotationFromVector(Eigen::Vector3d(0.4, -1.1, 0.7));
  T_camera_ct.translation() = Eigen::Vector3d(12.0, -30.0, 900.0);
  return T_camera_ct;
}

TEST(TargetGrid, FillsTheCubeAroundTheCentre) {
  const Eigen::Vector3d centre_ct_mm(10.0, 20.0, 30.0);
  const auto targets = targetGrid(centre_ct_mm, 100.0);
  ASSERT_EQ(targets.size(), 125U);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double reach = 0.0;
  for (const auto& target : targets) {
    mean += target / 125.0;
    reach = std::max(reach, (target - centre_ct_mm).cwiseAbs().maxCoeff());
  }
  EXPECT_LT((mean - centre_ct_mm).norm(), kRounding);
  EXPECT_NEAR(reach, 50.0, kRounding);
  EXPECT_NEAR((targets[1] - targets[0]).norm(), 25.0, kRounding);
}

TEST(PoseError, ZeroForTheSamePose) {
  const PoseError error = poseError(somePose(), somePose(), targetGrid(Eigen::Vector3d(1, 2, 3), 100.0));
  EXPECT_EQ(error.mtre_mm, 0.0);
  EXPECT_EQ(error.inplane_mm, 0.0);
}

TEST(PoseError, TranslationSplitsIntoInplaneAndDepth) {
  RigidTransform found = somePose();
  found.translation() += Eigen::Vector3d(3.0, 4.0, 12.0);
  const PoseError error = poseError(found, somePose(), targetGrid(Eigen::Vector3d(5, -6, 7), 100.0));
  EXPECT_NEAR(error.mtre_mm, 13.0, kRounding);
  EXPECT_NEAR(error.inplane_mm, 5.0, kRounding);
}

TEST(PoseError, DepthAloneIsNotInplane) {
  RigidTransform found = somePose();
  found.translation().z() -= 2.5;
  const PoseError error = poseError(found, somePose(), targetGrid(Eigen::Vector3d::Zero(), 40.0));
  EXPECT_NEAR(error.mtre_mm, 2.5, kRounding);
  EXPECT_NEAR(error.inplane_mm, 0.0, kRounding);
}

TEST(PoseError, RotationAboutTheViewingAxisMovesEachTargetByItsChord) {
  const Eigen::Vector3d centre_ct_mm(20.0, 40.0, -60.0);
  RigidTransform truth = RigidTransform::Identity();
  truth.translation() = Eigen::Vector3d(0.0, 0.0, 800.0) - centre_ct_mm;
  const double angle = 0.02;
  Twist twist = Twist::Zero();
  twist(5) = angle;
  const RigidTransform found = updatedPose(truth, twist, truth * centre_ct_mm);
  // Mean distance of a 5 × 5 grid of side 100 from its centre, times the chord of the angle.
  double mean_radius = 0.0;
  for (int y = -2; y <= 2; ++y) {
    for (int x = -2; x <= 2; ++x) mean_radius += 25.0 * std::hypot(x, y) / 25.0;
  }
  const double chord = 2.0 * std::sin(angle / 2.0) * mean_radius;
  const PoseError error = poseError(found, truth, targetGrid(centre_ct_mm, 100.0));
  EXPECT_NEAR(error.mtre_mm, chord, kRounding);
  EXPECT_NEAR(error.inplane_mm, chord, kRounding);
}

}  // namespace
}  // namespace xray_registration
