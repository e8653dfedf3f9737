#include "xray_registration/common/statistics.h"

#include <gtest/gtest.h>

#include <limits>

namespace xray_registration {
namespace {

const double kInfinity = std::numeric_limits<double>::infinity();

TEST(Statistics, ValueOfRank) {
  std::vector<float> values = {5.0F, 1.0F, 4.0F, 2.0F, 3.0F};
  for (std::size_t rank = 0; rank < values.size(); ++rank) {
    EXPECT_EQ(valueOfRank(&values, rank), static_cast<float>(rank + 1));
  }
}

TEST(Statistics, QuantileBelowIsOneOfTheValues) {
  std::vector<int> values = {40, 10, 30, 20};
  EXPECT_EQ(quantileBelow(&values, 0.0), 10);
  EXPECT_EQ(quantileBelow(&values, 0.5), 20);  // Rank 1.5.
  EXPECT_EQ(quantileBelow(&values, 0.99), 30);
  EXPECT_EQ(quantileBelow(&values, 1.0), 40);
}

TEST(Statistics, QuantileInterpolates) {
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.95), 3.85);
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 0.0), 1.0);
  EXPECT_DOUBLE_EQ(quantile({4.0, 1.0, 3.0, 2.0}, 1.0), 4.0);
  EXPECT_DOUBLE_EQ(median({3.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(largest({3.0, 7.0, 2.0}), 7.0);
}

TEST(Statistics, FewOrNoValues) {
  EXPECT_EQ(median({}), 0.0);
  EXPECT_EQ(largest({}), 0.0);
  EXPECT_EQ(percentiles({}).p99, 0.0);
  EXPECT_EQ(percentiles({7.0}).median, 7.0);
  EXPECT_EQ(percentiles({7.0}).p99, 7.0);
}

TEST(Statistics, InfiniteValues) {
  EXPECT_EQ(quantile({1.0, kInfinity, kInfinity, kInfinity}, 0.95), kInfinity);
  EXPECT_EQ(median({1.0, 2.0, kInfinity}), 2.0);
}

TEST(Statistics, Percentiles) {
  std::vector<double> values;
  for (int i = 100; i >= 0; --i) values.push_back(i);
  const Percentiles found = percentiles(values);
  EXPECT_DOUBLE_EQ(found.median, 50.0);
  EXPECT_DOUBLE_EQ(found.p95, 95.0);
  EXPECT_DOUBLE_EQ(found.p99, 99.0);
}

}  // namespace
}  // namespace xray_registration
