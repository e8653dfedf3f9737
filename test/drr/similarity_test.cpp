#include "xray_registration/drr/similarity.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace xray_registration {
namespace {

TEST(SimilarityTest, EachIsFoundByItsOwnName) {
  std::set<std::string> names;
  for (const SimilarityKind& kind : kSimilarities) {
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name << " stands twice";
    EXPECT_EQ(similarityNamed(kind.name), kind.similarity);
    EXPECT_STREQ(kindOf(kind.similarity).name, kind.name);
  }
  EXPECT_EQ(names.count("local_normalised"), 1U);
  EXPECT_EQ(names.count("gain_offset"), 1U);
  EXPECT_EQ(names.count("gradient_correlation"), 1U);
  EXPECT_FALSE(similarityNamed("mutual_information").has_value());
  EXPECT_FALSE(similarityNamed("").has_value());
}

TEST(SimilarityTest, TheFirstIsTheDefault) {
  EXPECT_EQ(kSimilarities[0].similarity, WindowOptions{}.similarity);
  EXPECT_EQ(kSimilarities[0].span, WindowOptions{}.span);
}

TEST(SimilarityTest, WindowsGrowWithTheXraysDeviation) {
  for (const SimilarityKind& kind : kSimilarities) {
    const WindowOptions one = windowsFor(kind.similarity, 1.0);
    const WindowOptions two = windowsFor(kind.similarity, 2.0);
    EXPECT_EQ(one.similarity, kind.similarity);
    EXPECT_EQ(one.span, kind.span);
    EXPECT_GT(one.epsilon_value, 0.0) << "a flat window would be divided by zero";
    EXPECT_EQ(two.epsilon_value, one.epsilon_value) << "the DRR's unit is fixed";
    EXPECT_EQ(two.epsilon_xray, 2.0 * one.epsilon_xray);
    EXPECT_EQ(two.contrast, 2.0 * one.contrast);
  }
}

}  // namespace
}  // namespace xray_registration
