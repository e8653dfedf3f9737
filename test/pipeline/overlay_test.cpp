#include "xray_registration/pipeline/overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace xray_registration {
namespace {

FloatImage disc(float inside) {
  FloatImage image(64, 48);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      if ((u - 32) * (u - 32) + (v - 24) * (v - 24) < 144) image.at(u, v) = inside;
    }
  }
  return image;
}

bool isGrey(const Rgb& p) { return p[0] == p[1] && p[1] == p[2]; }

TEST(Overlay, DrawsEdgesInTheColourOfTheVerdict) {
  for (const OverlayColour colour : {OverlayColour::kAccepted, OverlayColour::kRefused}) {
    const RgbImage image = drawOverlay(disc(2.0F), {}, disc(3.0F), colour);
    EXPECT_EQ(image.width, 64);
    EXPECT_EQ(image.height, 48);
    const std::size_t strong = colour == OverlayColour::kAccepted ? 1U : 0U;
    int edges = 0;
    for (int v = 0; v < 48; ++v) {
      for (int u = 0; u < 64; ++u) {
        const Rgb p = image.at(u, v);
        if (isGrey(p)) continue;
        ++edges;
        EXPECT_EQ(*std::max_element(p.begin(), p.end()), p[strong]);
        // Blurred by one pixel and thinned: the line lies within two pixels of the disc's rim (radius 12).
        const double radius = std::hypot(u - 32.0, v - 24.0);
        EXPECT_NEAR(radius, 12.0, 2.0);
      }
    }
    EXPECT_GT(edges, 40);  // The rim is about 75 pixels long.
    EXPECT_TRUE(isGrey(image.at(32, 24)));
    EXPECT_GT(image.at(32, 24)[0], image.at(2, 2)[0]);  // Bones bright.
  }
}

TEST(Overlay, TintsWhatTheMaskLeavesOut) {
  MaskImage mask(64, 48, 1);
  for (int u = 0; u < 64; ++u) mask.at(u, 3) = 0;
  const RgbImage image = drawOverlay(disc(2.0F), mask, {}, OverlayColour::kAccepted);
  EXPECT_GT(image.at(10, 3)[2], image.at(10, 3)[0]);
  EXPECT_TRUE(isGrey(image.at(10, 4)));
}

TEST(Overlay, RefusesOtherSizes) {
  EXPECT_THROW(drawOverlay(disc(1.0F), {}, FloatImage(3, 3), OverlayColour::kAccepted), std::invalid_argument);
  EXPECT_THROW(drawOverlay({}, {}, {}, OverlayColour::kAccepted), std::invalid_argument);
}

TEST(Overlay, DrawsEachLineInItsColourAndARefusedOneDashed) {
  FloatImage other(64, 48);
  for (int v = 10; v < 40; ++v) {
    for (int u = 50; u < 60; ++u) other.at(u, v) = 1.0F;
  }
  const FloatImage first = disc(3.0F);
  const auto count = [&](bool dashed, const Rgb& colour) {
    const RgbImage image =
        drawOverlay(disc(2.0F), {}, {{&first, {255, 215, 0}, false}, {&other, {255, 50, 40}, dashed}});
    return std::count(image.pixels.begin(), image.pixels.end(), colour);
  };
  const auto whole = count(false, {255, 50, 40});
  const auto dashed = count(true, {255, 50, 40});
  EXPECT_GT(count(true, {255, 215, 0}), 40);
  EXPECT_GT(whole, 40);
  EXPECT_GT(dashed, whole / 4);
  EXPECT_LT(dashed, 3 * whole / 4);
  const FloatImage small(3, 3);
  EXPECT_THROW(drawOverlay(first, {}, {{&small}}), std::invalid_argument);
}

TEST(Overlay, ConstantImagesAreDrawn) {
  const FloatImage flat(64, 48, 1.0F);
  EXPECT_TRUE(isGrey(drawOverlay(flat, {}, flat, OverlayColour::kAccepted).at(5, 5)));
}

}  // namespace
}  // namespace xray_registration
