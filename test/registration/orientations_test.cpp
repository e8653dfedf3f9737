#include "registration/orientations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {
namespace {

double angleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(a * b.transpose()).angle();
}

double nearest(const std::vector<Eigen::Matrix3d>& rotations, const Eigen::Matrix3d& sought) {
  double angle = 10.0;
  for (const Eigen::Matrix3d& rotation : rotations) angle = std::min(angle, angleBetween(rotation, sought));
  return angle;
}

Eigen::Matrix3d randomRotation(std::mt19937* random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(*random), normal(*random), normal(*random), normal(*random))
      .normalized()
      .toRotationMatrix();
}

TEST(EvenRotations, AreRotationsNearEveryOther) {
  constexpr double kSpacing = 0.4;
  const std::vector<Eigen::Matrix3d> rotations = evenRotations(kSpacing);
  for (const Eigen::Matrix3d& rotation : rotations) {
    ASSERT_TRUE((rotation * rotation.transpose()).isIdentity(1e-9));
    ASSERT_GT(rotation.determinant(), 0.0);
  }
  std::mt19937 random(1);
  double sum = 0.0;
  for (int i = 0; i < 300; ++i) {
    const double angle = nearest(rotations, randomRotation(&random));
    // A cube of that side reaches 0.87 of it; the spiral's cells are a little longer.
    EXPECT_LT(angle, 1.1 * kSpacing);
    sum += angle;
  }
  // The mean in a cube is 0.48.
  EXPECT_LT(sum / 300, 0.6 * kSpacing);
}

TEST(OrientationsAround, FillTheRangeAndNoMore) {
  const Eigen::Matrix3d centre = rotationFromVector({0.4, -1.0, 2.0});
  const std::vector<Eigen::Matrix3d> found = orientationsAround(centre, 0.7, 0.3);
  EXPECT_TRUE(found.front().isApprox(centre));
  for (const Eigen::Matrix3d& rotation : found) EXPECT_LT(angleBetween(rotation, centre), 0.7 + 0.076);
  EXPECT_LT(nearest(found, rotationFromVector({0.0, 0.6, 0.0}) * centre), 0.3);
  EXPECT_LT(nearest(found, rotationFromVector({-0.3, 0.0, 0.5}) * centre), 0.3);
  EXPECT_EQ(orientationsAround(centre, 0.0, 0.3).size(), 1U);
}

TEST(UsualOrientations, BeginWithTheStandardViews) {
  const std::vector<Eigen::Matrix3d> found = usualOrientations(0.4);
  // From the front, head up: the patient's left (+x) is right in the image, the head (+z) up (−y), the back (+y) away.
  Eigen::Matrix3d front;
  front << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  EXPECT_TRUE(found.front().isApprox(front, 1e-9)) << found.front();
  ASSERT_GT(found.size(), 16U);
  for (const Eigen::Matrix3d& rotation : found) ASSERT_GT(rotation.determinant(), 0.99);
  // Head down, from the left side.
  Eigen::Matrix3d lateral;
  lateral << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  EXPECT_LT(std::min(nearest(found, lateral), nearest(found, rotationFromVector({0.0, 0.0, 0.1}) * lateral)), 0.2);
}

TEST(UsualOrientations, LeaveOutABeamAlongThePatient) {
  for (const Eigen::Matrix3d& rotation : usualOrientations(0.4)) EXPECT_LT(std::abs(rotation(2, 2)), 0.65);
}

}  // namespace
}  // namespace xray_registration
