#include "evaluation/wrong_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace xray_registration {
namespace {

/// No two pixels alike, no symmetry, wider than high.
FloatImage someImage() {
  FloatImage image(5, 3);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i * i + 10);
  return image;
}

void expectSame(const FloatImage& a, const FloatImage& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.pixels, b.pixels);
}

TEST(WrongImage, MirroredPixelsStandOnTheOtherSide) {
  const FloatImage image = someImage();
  const FloatImage left_right = mirroredLeftRight(image);
  const FloatImage up_down = mirroredUpDown(image);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      EXPECT_EQ(left_right.at(image.width - 1 - u, v), image.at(u, v));
      EXPECT_EQ(up_down.at(u, image.height - 1 - v), image.at(u, v));
    }
  }
  expectSame(mirroredLeftRight(left_right), image);
  expectSame(mirroredUpDown(up_down), image);
}

TEST(WrongImage, TurnedClockwise) {
  const FloatImage image = someImage();
  const FloatImage quarter = turned(image, 1);
  ASSERT_EQ(quarter.width, image.height);
  // Top left goes to top right.
  EXPECT_EQ(quarter.at(quarter.width - 1, 0), image.at(0, 0));
  EXPECT_EQ(quarter.at(0, 0), image.at(0, image.height - 1));
  // Half a turn is both mirrors.
  expectSame(turned(image, 2), mirroredLeftRight(mirroredUpDown(image)));
  expectSame(turned(turned(image, 3), 1), image);
}

TEST(WrongImage, InvertedKeepsTheRange) {
  const FloatImage image = someImage();
  const FloatImage dark = inverted(image);
  EXPECT_EQ(dark.pixels.front(), image.pixels.back());
  EXPECT_EQ(dark.pixels.back(), image.pixels.front());
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    EXPECT_EQ(dark.pixels[i] + image.pixels[i], image.pixels.front() + image.pixels.back());
  }
  expectSame(inverted(dark), image);
  EXPECT_TRUE(inverted(FloatImage()).empty());
}

/// Pixels tell their own column (or row): what an image then shows is where it came from.
FloatImage positions(int size, bool columns) {
  FloatImage image(size, size);
  for (int v = 0; v < size; ++v) {
    for (int u = 0; u < size; ++u) image.at(u, v) = static_cast<float>(columns ? u : v);
  }
  return image;
}

/// Linear images are interpolated exactly; what remains is float's rounding of positions up to 100.
constexpr double kRoundingPx = 1e-4;

TEST(WrongImage, RadialDistortionMovesPointsAsThePolynomialSays) {
  const XrayCamera camera{101, 101, 200.0, 210.0, 48.0, 52.0};
  constexpr double kK1 = -0.2;
  const FloatImage from_u = radiallyDistorted(positions(101, true), camera, kK1);
  const FloatImage from_v = radiallyDistorted(positions(101, false), camera, kK1);
  double largest_px = 0.0;
  // Farther out a barrel's border shows what lies outside.
  for (int v = 10; v <= 90; ++v) {
    for (int u = 10; u <= 90; ++u) {
      const Eigen::Vector3d straight = camera.rayDirection(from_u.at(u, v), from_v.at(u, v));
      const double stretch = 1.0 + kK1 * straight.head<2>().squaredNorm();
      const Eigen::Vector2d shown =
          camera.project(Eigen::Vector3d(stretch * straight.x(), stretch * straight.y(), 1.0));
      EXPECT_LT((shown - Eigen::Vector2d(u, v)).norm(), kRoundingPx);
      largest_px = std::max<double>(largest_px, std::hypot(from_u.at(u, v) - u, from_v.at(u, v) - v));
    }
  }
  EXPECT_GT(largest_px, 0.5);
  EXPECT_THROW(radiallyDistorted(positions(101, true), camera, -20.0), std::invalid_argument);
}

TEST(WrongImage, TheSShapeTurnsMoreFartherOut) {
  // With an odd size the centre is a pixel; half a width from it is column 0.5, and the row at 80 is 30 of 50.5 away.
  constexpr double kEdgePx = 3.0;
  const FloatImage from_u = sShaped(positions(101, true), kEdgePx);
  const FloatImage from_v = sShaped(positions(101, false), kEdgePx);
  EXPECT_NEAR(from_u.at(50, 50), 50.0, kRoundingPx);
  EXPECT_NEAR(from_v.at(50, 50), 50.0, kRoundingPx);
  const double ratio = 30.0 / 50.5;
  const double angle = kEdgePx / 50.5 * ratio * ratio;
  // Clockwise: what is shown at the right came from above.
  EXPECT_NEAR(from_u.at(80, 50), 50.0 + 30.0 * std::cos(angle), kRoundingPx);
  EXPECT_NEAR(from_v.at(80, 50), 50.0 - 30.0 * std::sin(angle), kRoundingPx);
}

}  // namespace
}  // namespace xray_registration
