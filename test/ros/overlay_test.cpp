#include "xray_registration/ros/overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "xray_registration/ros/surface_marker.h"

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

std::array<int, 3> pixel(const sensor_msgs::Image& image, int u, int v) {
  const std::uint8_t* p = &image.data[static_cast<std::size_t>(v) * image.step + static_cast<std::size_t>(u) * 3];
  return {p[0], p[1], p[2]};
}

bool isGrey(const std::array<int, 3>& p) { return p[0] == p[1] && p[1] == p[2]; }

TEST(Overlay, DrawsEdgesInTheColourOfTheVerdict) {
  for (const OverlayColour colour : {OverlayColour::kAccepted, OverlayColour::kRefused}) {
    const sensor_msgs::Image image = drawOverlay(disc(2.0F), {}, disc(3.0F), colour);
    EXPECT_EQ(image.encoding, "rgb8");
    EXPECT_EQ(image.step, 64U * 3U);
    const int strong = colour == OverlayColour::kAccepted ? 1 : 0;
    int edges = 0;
    for (int v = 0; v < 48; ++v) {
      for (int u = 0; u < 64; ++u) {
        const std::array<int, 3> p = pixel(image, u, v);
        if (isGrey(p)) continue;
        ++edges;
        EXPECT_EQ(*std::max_element(p.begin(), p.end()), p[strong]);
        // Blurred by one pixel and thinned: the line lies within two pixels of the disc's rim (radius 12).
        const double radius = std::hypot(u - 32.0, v - 24.0);
        EXPECT_NEAR(radius, 12.0, 2.0);
      }
    }
    EXPECT_GT(edges, 40);  // The rim is about 75 pixels long.
    EXPECT_TRUE(isGrey(pixel(image, 32, 24)));
    EXPECT_GT(pixel(image, 32, 24)[0], pixel(image, 2, 2)[0]);  // Bones bright.
  }
}

TEST(Overlay, TintsWhatTheMaskLeavesOut) {
  MaskImage mask(64, 48, 1);
  for (int u = 0; u < 64; ++u) mask.at(u, 3) = 0;
  const sensor_msgs::Image image = drawOverlay(disc(2.0F), mask, {}, OverlayColour::kAccepted);
  EXPECT_GT(pixel(image, 10, 3)[2], pixel(image, 10, 3)[0]);
  EXPECT_TRUE(isGrey(pixel(image, 10, 4)));
}

TEST(Overlay, RefusesOtherSizes) {
  EXPECT_THROW(drawOverlay(disc(1.0F), {}, FloatImage(3, 3), OverlayColour::kAccepted), std::invalid_argument);
  EXPECT_THROW(drawOverlay({}, {}, {}, OverlayColour::kAccepted), std::invalid_argument);
}

TEST(Overlay, ConstantImagesAreDrawn) {
  const FloatImage flat(64, 48, 1.0F);
  EXPECT_TRUE(isGrey(pixel(drawOverlay(flat, {}, flat, OverlayColour::kAccepted), 5, 5)));
}

TEST(SurfaceMarker, IsInMetresInTheCtFrame) {
  TriangleMesh mesh;
  mesh.vertices_ct_mm = {{0, 0, 0}, {1000, 0, 0}, {0, 500, 0}};
  mesh.triangles = {{0, 1, 2}};
  const visualization_msgs::Marker marker = toMarker(mesh, "ct");
  EXPECT_EQ(marker.header.frame_id, "ct");
  EXPECT_EQ(marker.type, visualization_msgs::Marker::TRIANGLE_LIST);
  ASSERT_EQ(marker.points.size(), 3U);
  EXPECT_DOUBLE_EQ(marker.points[1].x, 1.0);
  EXPECT_DOUBLE_EQ(marker.points[2].y, 0.5);
  EXPECT_EQ(toMarker({}, "ct").action, visualization_msgs::Marker::DELETE);
}

TEST(SurfaceMarker, ReducedCtKeepsItsPlace) {
  Volume ct;
  ct.grid.size = {41, 40, 30};
  ct.grid.spacing_mm = {1.0, 2.0, 3.0};
  ct.grid.origin_ct_mm = {10.0, 20.0, 30.0};
  for (int z = 0; z < 30; ++z) {
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 41; ++x) ct.hu.push_back(static_cast<std::int16_t>(10 * x + 100 * (y / 10)));
    }
  }
  const Volume reduced = reducedForDisplay(ct, 8000);
  EXPECT_LE(reduced.grid.voxelCount(), 8000U);
  EXPECT_EQ(reduced.hu.size(), reduced.grid.voxelCount());
  const double factor = reduced.grid.spacing_mm.x();
  // HU rises by 10 per voxel of 1 mm along x, so a block's mean is the value at its centre.
  const double x_ct = (reduced.grid.ctFromIndex() * Eigen::Vector3d(3, 0, 0)).x();
  EXPECT_NEAR(reduced.hu[3], 10.0 * (x_ct - 10.0), 1.0);  // Rounded to whole HU.
  EXPECT_GE(factor, 2.0);
  EXPECT_EQ(reducedForDisplay(ct, 1000000).hu, ct.hu);
}

}  // namespace
}  // namespace xray_registration
