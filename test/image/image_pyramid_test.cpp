#include "xray_registration/image/image_pyramid.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace xray_registration {
namespace {

FloatImage ramp(int width, int height) {
  FloatImage image(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) image.at(u, v) = static_cast<float>(3 * u + 10 * v);
  return image;
}

TEST(ImagePyramid, BlocksAreAveragedAndTheRestIsDropped) {
  FloatImage binned;
  MaskImage mask;
  binImage(ramp(8, 5), {}, 3, &binned, &mask);
  ASSERT_EQ(binned.width, 2);
  ASSERT_EQ(binned.height, 1);
  // The mean of a plane over a block is its value at the block's centre: small integers, exact in float.
  EXPECT_EQ(binned.at(0, 0), 3 * 1 + 10 * 1);
  EXPECT_EQ(binned.at(1, 0), 3 * 4 + 10 * 1);
  EXPECT_NE(mask.at(0, 0), 0);
}

TEST(ImagePyramid, AgreesWithTheBinnedCamera) {
  const XrayCamera camera{8, 6, 100.0, 90.0, 3.0, 2.5};
  FloatImage horizontal(8, 6);
  for (int v = 0; v < 6; ++v)
    for (int u = 0; u < 8; ++u) horizontal.at(u, v) = static_cast<float>(camera.rayDirection(u, v).x());
  FloatImage binned;
  MaskImage mask;
  binImage(horizontal, {}, 2, &binned, &mask);
  // A linear image of ray directions stays one; float rounding of values below 0.1.
  for (int u = 0; u < 4; ++u) EXPECT_NEAR(binned.at(u, 1), camera.binned(2).rayDirection(u, 1).x(), 1e-8);
}

TEST(ImagePyramid, MaskedPixelsDoNotCount) {
  MaskImage mask(4, 2, 1);
  mask.at(0, 0) = 0;                              // One of four: the block stays, of the other three.
  for (int v = 0; v < 2; ++v) mask.at(3, v) = 0;  // Half: stays.
  FloatImage binned;
  MaskImage binned_mask;
  binImage(ramp(4, 2), mask, 2, &binned, &binned_mask);
  EXPECT_FLOAT_EQ(binned.at(0, 0), (3.0F + 10.0F + 13.0F) / 3.0F);
  EXPECT_FLOAT_EQ(binned.at(1, 0), (6.0F + 16.0F) / 2.0F);
  EXPECT_NE(binned_mask.at(0, 0), 0);
  EXPECT_NE(binned_mask.at(1, 0), 0);
  mask.at(2, 0) = 0;
  mask.at(2, 1) = 0;
  binImage(ramp(4, 2), mask, 2, &binned, &binned_mask);
  EXPECT_EQ(binned_mask.at(1, 0), 0);
  EXPECT_FLOAT_EQ(binned.at(1, 0), (6.0F + 9.0F + 16.0F + 19.0F) / 4.0F);
}

TEST(ImagePyramid, AWindowOfCountsIsThatOfTheirValues) {
  // Large enough for several threads, and the window's sides are no whole number of blocks.
  CountImage counts(700, 600);
  for (std::size_t i = 0; i < counts.pixels.size(); ++i) counts.pixels[i] = static_cast<std::uint16_t>(i * 7919 % 1000);
  std::vector<float> worth(1000);
  for (std::size_t i = 0; i < worth.size(); ++i) worth[i] = 5.0F - 0.005F * static_cast<float>(i);
  const AttenuationImage image(counts, worth);
  MaskImage mask(700, 600, 255);
  for (std::size_t i = 0; i < mask.pixels.size(); i += 5) mask.pixels[i] = 0;
  const PixelWindow window{13, 21, 641, 502};
  FloatImage binned;
  MaskImage binned_mask;
  binImage(image, mask, window, 3, &binned, &binned_mask);
  ASSERT_EQ(binned.width, 213);
  ASSERT_EQ(binned.height, 167);
  for (int v = 0; v < binned.height; ++v) {
    for (int u = 0; u < binned.width; ++u) {
      double sum = 0.0;
      int allowed = 0;
      for (int i = 0; i < 9; ++i) {
        const int from_u = window.x + 3 * u + i % 3;
        const int from_v = window.y + 3 * v + i / 3;
        if (mask.at(from_u, from_v) == 0) continue;
        sum += image.at(from_u, from_v);
        ++allowed;
      }
      ASSERT_NEAR(binned.at(u, v), sum / allowed, 1e-5) << u << ", " << v;
      ASSERT_EQ(binned_mask.at(u, v), 2 * allowed >= 9 ? 255 : 0) << u << ", " << v;
    }
  }
  for (const PixelWindow& outside : {PixelWindow{-1, 0, 9, 9}, {0, 0, 701, 9}, {0, 598, 9, 3}, {0, 0, 9, -1}}) {
    EXPECT_THROW(binImage(image, mask, outside, 3, &binned, &binned_mask), std::invalid_argument);
  }
}

TEST(ImagePyramid, ResultMayReplaceItsSource) {
  FloatImage image = ramp(4, 4);
  MaskImage mask;
  binImage(image, mask, 2, &image, &mask);
  EXPECT_EQ(image.width, 2);
  EXPECT_FLOAT_EQ(image.at(0, 0), 6.5F);
}

TEST(ImagePyramid, RefusesBadArguments) {
  FloatImage binned;
  MaskImage mask;
  EXPECT_THROW(binImage(ramp(4, 4), {}, 0, &binned, &mask), std::invalid_argument);
  EXPECT_THROW(binImage(ramp(4, 4), MaskImage(3, 4, 1), 2, &binned, &mask), std::invalid_argument);
}

}  // namespace
}  // namespace xray_registration
