#include "xray_registration/evaluation/random_starts.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace xray_registration {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

TEST(RandomStarts, StayInTheirRangeAndFillIt) {
  RandomStarts starts({15.0 * kDegree, 25.0}, 7);
  double largest_angle = 0.0;
  Twist mean = Twist::Zero();
  Twist reach = Twist::Zero();
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const Twist start = starts.next();
    EXPECT_LE(start.head<3>().cwiseAbs().maxCoeff(), 25.0);
    // The axis is normalised in double.
    EXPECT_LE(start.tail<3>().norm(), 15.0 * kDegree * (1.0 + 1e-12));
    largest_angle = std::max(largest_angle, start.tail<3>().norm());
    mean += start / kCount;
    reach = reach.cwiseMax(start.cwiseAbs());
  }
  EXPECT_GT(largest_angle, 14.9 * kDegree);
  EXPECT_GT(reach.head<3>().minCoeff(), 24.9);
  // Standard deviation of the mean of 4000 uniform values in ±25 is 0.23 mm; of a rotation component in ±15° about
  // 0.08°. Five of them.
  EXPECT_LT(mean.head<3>().cwiseAbs().maxCoeff(), 1.15);
  EXPECT_LT(mean.tail<3>().cwiseAbs().maxCoeff(), 0.4 * kDegree);
}

TEST(RandomStarts, AxesHaveNoPreferredDirection) {
  RandomStarts starts({1.0, 0.0}, 3);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Vector3d axis = starts.next().tail<3>().normalized();
    scatter += axis * axis.transpose() / kCount;
  }
  // E[a aᵀ] = I/3; each entry's standard deviation is at most 0.3 / √4000 = 0.005. Five of them.
  EXPECT_LT((scatter - Eigen::Matrix3d::Identity() / 3.0).cwiseAbs().maxCoeff(), 0.025);
}

TEST(RandomStarts, SameSeedSameStartsOnEveryPlatform) {
  RandomStarts starts({0.1, 10.0}, 1);
  RandomStarts again({0.1, 10.0}, 1);
  RandomStarts other({0.1, 10.0}, 2);
  const Twist first = starts.next();
  EXPECT_EQ(first, again.next());
  EXPECT_NE(first, other.next());
  EXPECT_NE(first, starts.next());
  // The standard fixes the generator's bits and the arithmetic is IEEE: the values are the same everywhere.
  Twist expected;
  expected << -8.2109361271069119, 1.1235779824475998, 5.7930393901296711, -0.0018300241048526823,
      -0.026628007489140456, 0.0043703003556542792;
  for (int i = 0; i < 6; ++i) EXPECT_DOUBLE_EQ(first(i), expected(i)) << "component " << i;
}

}  // namespace
}  // namespace xray_registration
