#include "xray_registration/geometry/joint_angles.h"

#include <gtest/gtest.h>

#include <cmath>

namespace xray_registration {
namespace {

constexpr double kDegree = M_PI / 180.0;
// A few products of rotations in double.
constexpr double kRounding = 1e-12;

Eigen::Matrix3d turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(degrees * kDegree, axis).toRotationMatrix();
}

Eigen::Matrix3d turns(double x, double y, double z) {
  return turn(x, Eigen::Vector3d::UnitX()) * turn(y, Eigen::Vector3d::UnitY()) * turn(z, Eigen::Vector3d::UnitZ());
}

TEST(CardanAngles, UndoTheTurnsThatMadeTheRotation) {
  for (const double x : {-170.0, -30.0, 0.0, 95.0}) {
    for (const double y : {-89.0, -10.0, 0.0, 60.0}) {
      for (const double z : {-120.0, 0.0, 5.0, 179.0}) {
        const CardanAngles angles = cardanAngles(turns(x, y, z));
        EXPECT_NEAR(angles.x_rad, x * kDegree, 1e-10) << x << " " << y << " " << z;
        EXPECT_NEAR(angles.y_rad, y * kDegree, 1e-10);
        EXPECT_NEAR(angles.z_rad, z * kDegree, 1e-10);
        EXPECT_FALSE(angles.is_locked);
      }
    }
  }
}

TEST(CardanAngles, WhenLockedTheyStillMakeTheRotation) {
  for (const double y : {90.0, -90.0}) {
    const Eigen::Matrix3d rotation = turns(25.0, y, -40.0);
    const CardanAngles angles = cardanAngles(rotation);
    EXPECT_TRUE(angles.is_locked);
    EXPECT_EQ(angles.z_rad, 0.0);
    EXPECT_NEAR(angles.y_rad, y * kDegree, 1e-7);
    const Eigen::Matrix3d again = turns(angles.x_rad / kDegree, angles.y_rad / kDegree, 0.0);
    EXPECT_LT((again - rotation).cwiseAbs().maxCoeff(), 1e-7);
  }
}

// A knee whose tibia was turned about axes that are named one by one, in the anatomical frames (x right, y front, z
// up).
struct Knee {
  RigidTransform T_femur_tibia = RigidTransform::Identity();
  Eigen::Vector3d foot() const { return T_femur_tibia * Eigen::Vector3d(0.0, 0.0, -400.0); }
  Eigen::Vector3d toes() const { return T_femur_tibia.linear() * Eigen::Vector3d::UnitY(); }
};

TEST(KneeMotion, FlexionMovesTheShankBackwards) {
  Knee knee;
  knee.T_femur_tibia.linear() = turn(-70.0, Eigen::Vector3d::UnitX());
  ASSERT_LT(knee.foot().y(), -300.0);
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const KneeMotion motion = kneeMotion(knee.T_femur_tibia, side);
    EXPECT_NEAR(motion.flexion_rad, 70.0 * kDegree, kRounding);
    EXPECT_NEAR(motion.adduction_rad, 0.0, kRounding);
    EXPECT_NEAR(motion.internal_rotation_rad, 0.0, kRounding);
  }
}

TEST(KneeMotion, AdductionMovesTheFootTowardsTheOtherLeg) {
  Knee knee;
  knee.T_femur_tibia.linear() = turn(8.0, Eigen::Vector3d::UnitY());
  ASSERT_LT(knee.foot().x(), -50.0);  // To the left: towards the other leg for a right knee.
  EXPECT_NEAR(kneeMotion(knee.T_femur_tibia, Side::kRight).adduction_rad, 8.0 * kDegree, kRounding);
  EXPECT_NEAR(kneeMotion(knee.T_femur_tibia, Side::kLeft).adduction_rad, -8.0 * kDegree, kRounding);
}

TEST(KneeMotion, InternalRotationTurnsTheToesTowardsTheOtherLeg) {
  Knee knee;
  knee.T_femur_tibia.linear() = turn(15.0, Eigen::Vector3d::UnitZ());
  ASSERT_LT(knee.toes().x(), -0.2);  // To the left.
  EXPECT_NEAR(kneeMotion(knee.T_femur_tibia, Side::kRight).internal_rotation_rad, 15.0 * kDegree, kRounding);
  EXPECT_NEAR(kneeMotion(knee.T_femur_tibia, Side::kLeft).internal_rotation_rad, -15.0 * kDegree, kRounding);
}

// The definition by the axes' vectors, which does not know of Cardan angles.
TEST(KneeMotion, FollowsTheAxesOfThePaper) {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector({-0.9, 0.15, 0.25});
  pose.translation() = Eigen::Vector3d(3.0, -12.0, -45.0);
  const Eigen::Vector3d e1 = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d e3 = pose.linear().col(2);
  const Eigen::Vector3d e2 = e3.cross(e1).normalized();
  const KneeMotion right = kneeMotion(pose, Side::kRight);
  EXPECT_NEAR(std::sin(right.flexion_rad), -e2.z(), kRounding);
  EXPECT_NEAR(std::cos(right.flexion_rad), e2.y(), kRounding);
  EXPECT_NEAR(std::sin(right.adduction_rad), e1.dot(e3), kRounding);
  EXPECT_NEAR(std::sin(right.internal_rotation_rad), e2.dot(pose.linear().col(0)), kRounding);
  EXPECT_NEAR(right.lateral_mm, pose.translation().dot(e1), 1e-10);
  EXPECT_NEAR(right.anterior_mm, pose.translation().dot(e2), 1e-10);
  EXPECT_NEAR(right.distraction_mm, -pose.translation().dot(e3), 1e-10);
  EXPECT_NEAR(kneeMotion(pose, Side::kLeft).lateral_mm, -right.lateral_mm, 1e-10);
}

TEST(KneeMotion, ALegTurnedSidewaysIsLocked) {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = turn(90.0, Eigen::Vector3d::UnitY());
  EXPECT_TRUE(kneeMotion(pose, Side::kRight).is_locked);
  EXPECT_FALSE(kneeMotion(RigidTransform::Identity(), Side::kRight).is_locked);
}

// The same motion seen by any camera, and with bodies in CT frames whose origins lie anywhere.
TEST(JointPose, IsThatOfTheAnatomicalFrames) {
  RigidTransform T_camera_femur = RigidTransform::Identity();
  T_camera_femur.linear() = rotationFromVector({1.1, -0.3, 0.6});
  T_camera_femur.translation() = Eigen::Vector3d(20.0, -30.0, 900.0);
  const RigidTransform T_femur_anatomy = anatomyInCt({-80.0, -100.0, 640.0});
  const RigidTransform T_tibia_anatomy = anatomyInCt({-81.0, -98.0, 600.0});
  RigidTransform knee = RigidTransform::Identity();
  knee.linear() = turns(-40.0, 3.0, 9.0);
  knee.translation() = Eigen::Vector3d(1.0, -2.0, -35.0);
  const RigidTransform T_camera_tibia = T_camera_femur * T_femur_anatomy * knee * T_tibia_anatomy.inverse();
  const RigidTransform found = jointPose(T_camera_femur, T_camera_tibia, T_femur_anatomy, T_tibia_anatomy);
  EXPECT_LT((found.matrix() - knee.matrix()).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(kneeMotion(found, Side::kRight).flexion_rad, 40.0 * kDegree, 1e-10);
  // Right, front, up in a frame of left, back, up.
  EXPECT_TRUE((anatomyInCt().linear() * Eigen::Vector3d(1.0, 1.0, 1.0)).isApprox(Eigen::Vector3d(-1.0, -1.0, 1.0)));
}

}  // namespace
}  // namespace xray_registration
