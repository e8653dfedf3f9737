#include "xray_registration/geometry/rigid_transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace xray_registration {
namespace {

const Eigen::Vector3d kCentre(12.0, -40.0, 900.0);

RigidTransform somePose() {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector({0.3, -0.8, 1.1});
  pose.translation() = Eigen::Vector3d(4.0, -7.0, 880.0);
  return pose;
}

// Products of a few rotations in double: 1e-12 leaves three digits for the size of the lengths (900 mm).
constexpr double kRounding = 1e-10;

TEST(RigidTransform, ExponentialAndLogarithmAreInverse) {
  for (const double angle : {1e-13, 1e-6, 0.5, 3.1}) {
    const Eigen::Vector3d omega = angle * Eigen::Vector3d(1.0, -2.0, 0.5).normalized();
    EXPECT_LT((vectorFromRotation(rotationFromVector(omega)) - omega).norm(), 1e-12) << angle;
  }
}

TEST(RigidTransform, UpdateTurnsAboutTheCentre) {
  Twist twist = Twist::Zero();
  twist.tail<3>() << 0.1, 0.2, -0.3;
  const RigidTransform pose = somePose();
  const Eigen::Vector3d centre_ct = pose.inverse() * kCentre;
  EXPECT_LT((updatedPose(pose, twist, kCentre) * centre_ct - kCentre).norm(), kRounding);
  EXPECT_GT((updatedPose(pose, twist, kCentre) * Eigen::Vector3d(0, 0, 0) - pose * Eigen::Vector3d(0, 0, 0)).norm(),
            1.0);
}

TEST(RigidTransform, TwistBetweenInvertsUpdate) {
  Twist twist;
  twist << 3.0, -2.0, 15.0, 0.1, -0.2, 0.3;
  const RigidTransform moved = updatedPose(somePose(), twist, kCentre);
  EXPECT_LT((twistBetween(somePose(), moved, kCentre) - twist).norm(), kRounding);
}

TEST(RigidTransform, TwistInAnotherCameraIsTheSameMotion) {
  RigidTransform T_other_first = RigidTransform::Identity();
  T_other_first.linear() = rotationFromVector({0.0, 0.9, 0.1});
  T_other_first.translation() << 700.0, 10.0, 300.0;
  Twist twist;
  twist << 3.0, -2.0, 15.0, 0.1, -0.2, 0.3;
  const RigidTransform moved_then_carried = T_other_first * updatedPose(somePose(), twist, kCentre);
  const RigidTransform carried_then_moved =
      updatedPose(T_other_first * somePose(), twistCarriedBy(T_other_first) * twist, T_other_first * kCentre);
  EXPECT_LT((moved_then_carried.matrix() - carried_then_moved.matrix()).norm(), kRounding);
}

TEST(RigidTransform, RefusesWhatIsNotRigid) {
  Eigen::Matrix4d matrix = somePose().matrix();
  EXPECT_TRUE(isRigid(matrix));
  matrix(0, 0) *= 1.1;
  EXPECT_FALSE(isRigid(matrix));
  EXPECT_THROW(rigidFromMatrix(matrix), std::invalid_argument);
  matrix = somePose().matrix();
  matrix.col(0) *= -1.0;
  EXPECT_FALSE(isRigid(matrix)) << "a mirror image is not a rotation";
  matrix = somePose().matrix();
  matrix(1, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(isRigid(matrix));
}

TEST(RigidFromQuaternion, NormalisesWhatIsNearlyOne) {
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  const Eigen::Quaterniond rounded(1.005 * rotation.coeffs());
  const RigidTransform transform = rigidFromQuaternion({1, 2, 3}, rounded);
  EXPECT_TRUE(transform.linear().isApprox(rotation.toRotationMatrix(), 1e-12));
  EXPECT_EQ(transform.translation(), Eigen::Vector3d(1, 2, 3));
}

TEST(RigidFromQuaternion, RefusesWhatIsNone) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_THROW(rigidFromQuaternion({0, 0, 0}, {0, 0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(rigidFromQuaternion({0, 0, 0}, {1.02, 0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(rigidFromQuaternion({0, inf, 0}, {1, 0, 0, 0}), std::invalid_argument);
  EXPECT_THROW(rigidFromQuaternion({0, 0, 0}, {inf, 0, 0, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace xray_registration
