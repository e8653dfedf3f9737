#include "xray_registration/image/attenuation_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace xray_registration {
namespace {

/// Count 10 v + u, worth its square root.
AttenuationImage rootsOfCounts() {
  CountImage counts(7, 5);
  for (int v = 0; v < 5; ++v) {
    for (int u = 0; u < 7; ++u) counts.at(u, v) = static_cast<std::uint16_t>(10 * v + u);
  }
  std::vector<float> worth(47);
  for (std::size_t i = 0; i < worth.size(); ++i) worth[i] = std::sqrt(static_cast<float>(i));
  return {counts, worth};
}

TEST(AttenuationImage, CountsAreWorthWhatTheTableSays) {
  const AttenuationImage image = rootsOfCounts();
  EXPECT_EQ(image.width(), 7);
  EXPECT_EQ(image.height(), 5);
  EXPECT_EQ(image.plain(), nullptr);
  const FloatImage values = image.values();
  std::vector<float> buffer;
  for (int v = 0; v < 5; ++v) {
    const float* row = image.row(v, 2, 4, &buffer);
    for (int u = 0; u < 7; ++u) {
      const float worth = std::sqrt(static_cast<float>(10 * v + u));
      EXPECT_EQ(image.at(u, v), worth);
      EXPECT_EQ(values.at(u, v), worth);
    }
    for (int u = 2; u < 6; ++u) {
      EXPECT_EQ(row[u - 2], image.at(u, v));
    }
  }
}

TEST(AttenuationImage, FloatsAreReadWhereTheyLie) {
  const AttenuationImage image = FloatImage(3, 2, 4.5F);
  std::vector<float> buffer;
  EXPECT_EQ(image.row(1, 1, 2, &buffer), &image.plain()->at(1, 1));
  EXPECT_TRUE(buffer.empty());
  EXPECT_EQ(image.counts(), nullptr);
}

TEST(AttenuationImage, CountsThatAreChangedBecomeFloats) {
  AttenuationImage image = rootsOfCounts();
  image.floats().at(3, 2) = -1.0F;
  EXPECT_EQ(image.counts(), nullptr);
  EXPECT_EQ(image.at(3, 2), -1.0F);
  EXPECT_EQ(image.at(4, 2), std::sqrt(24.0F)) << "the others stay";
  EXPECT_EQ(image.width(), 7);
}

TEST(AttenuationImage, KnowsWhatIsNotFinite) {
  EXPECT_TRUE(rootsOfCounts().allFinite());
  FloatImage floats(2, 2, 1.0F);
  EXPECT_TRUE(AttenuationImage(floats).allFinite());
  floats.at(1, 1) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(AttenuationImage(floats).allFinite());
  EXPECT_TRUE(AttenuationImage().empty());
}

}  // namespace
}  // namespace xray_registration
