#include "xray_registration/image/raw_image.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(RawImage, CountsAndFloatsHoldTheSameNumbers) {
  CountImage counts(3, 2);
  FloatImage floats(3, 2);
  for (std::size_t i = 0; i < 6; ++i) {
    counts.pixels[i] = static_cast<std::uint16_t>(65535 - i);
    floats.pixels[i] = 65535.0F - static_cast<float>(i);
  }
  for (const RawPixels& raw : {RawPixels(counts), RawPixels(floats)}) {
    EXPECT_EQ(raw.width(), 3);
    EXPECT_EQ(raw.height(), 2);
    EXPECT_EQ(floatsOf(raw).pixels, floats.pixels);
  }
}

}  // namespace
}  // namespace xray_registration
