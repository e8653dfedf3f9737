#include "xray_registration/evaluation/operating_curve.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

Trial trial(double final_mm, double similarity) {
  Trial made;
  made.final = {final_mm, final_mm < 3.0 ? 0.1 : 2.0};
  made.result.similarity = similarity;
  return made;
}

std::vector<OperatingPoint> bySimilarity(const std::vector<Trial>& trials) {
  return operatingCurve(trials, successCriteria(1), [](const Trial& t) { return t.result.similarity; });
}

TEST(OperatingCurve, RunsFromNothingToAll) {
  const auto curve = bySimilarity({trial(0.2, 0.9), trial(20.0, 0.8), trial(0.3, 0.7), trial(30.0, 0.1)});
  ASSERT_EQ(curve.size(), 5U);
  EXPECT_EQ(curve[0].true_acceptance, 0.0);
  EXPECT_EQ(curve[0].false_acceptance, 0.0);
  EXPECT_EQ(curve[1].threshold, 0.9);
  EXPECT_EQ(curve[1].true_acceptance, 0.5);
  EXPECT_EQ(curve[1].false_acceptance, 0.0);
  EXPECT_EQ(curve[2].false_acceptance, 0.5);
  EXPECT_EQ(curve[3].true_acceptance, 1.0);
  EXPECT_EQ(curve[4].true_acceptance, 1.0);
  EXPECT_EQ(curve[4].false_acceptance, 1.0);
}

TEST(OperatingCurve, EqualCuesPassTogether) {
  const auto curve = bySimilarity({trial(0.2, 0.5), trial(20.0, 0.5)});
  ASSERT_EQ(curve.size(), 2U);
  EXPECT_EQ(curve[1].true_acceptance, 1.0);
  EXPECT_EQ(curve[1].false_acceptance, 1.0);
}

TEST(OperatingCurve, WhatIsNeitherGoodNorWrongDoesNotCount) {
  // 4 mm is no success and, for one view, not yet a false acceptance.
  const auto curve = bySimilarity({trial(0.2, 0.9), trial(4.0, 0.8), trial(20.0, 0.5)});
  ASSERT_EQ(curve.size(), 3U);
  EXPECT_EQ(curve[2].false_acceptance, 1.0);
}

TEST(OperatingCurve, EmptyWhenThereIsNothingToTellApart) {
  EXPECT_TRUE(bySimilarity({}).empty());
  EXPECT_TRUE(bySimilarity({trial(0.2, 0.9), trial(0.3, 0.8)}).empty());
  EXPECT_TRUE(bySimilarity({trial(20.0, 0.9)}).empty());
}

}  // namespace
}  // namespace xray_registration
