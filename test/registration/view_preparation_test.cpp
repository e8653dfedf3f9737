#include "registration/view_preparation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace xray_registration {
namespace {

/// Every pixel knows its own place: 1000 v + u, exact in single precision.
XrayFrame numbered(const XrayCamera& camera) {
  XrayFrame view;
  view.camera = camera;
  view.attenuation = FloatImage(camera.width, camera.height);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) view.attenuation.floats().at(u, v) = static_cast<float>(1000 * v + u);
  }
  return view;
}

ShadowBounds sphere(const Eigen::Vector3d& centre_mm, double radius_mm) { return {centre_mm, radius_mm, {}, 0.0}; }

void expectSizes(const PreparedView& prepared) {
  EXPECT_EQ(prepared.attenuation.width, prepared.camera.width);
  EXPECT_EQ(prepared.attenuation.height, prepared.camera.height);
  EXPECT_EQ(prepared.weight.width, prepared.camera.width);
  EXPECT_EQ(prepared.weight.height, prepared.camera.height);
  EXPECT_STREQ(prepared.camera.problem(), "");
}

/// The prepared camera sees the point that the original camera sees in the same original pixel.
void expectSameRays(const XrayFrame& view, const PreparedView& prepared) {
  for (const int u : {0, prepared.camera.width / 3, prepared.camera.width - 1}) {
    for (const int v : {0, prepared.camera.height / 2, prepared.camera.height - 1}) {
      const Eigen::Vector3d point = 700.0 * prepared.camera.rayDirection(u, v);
      const Eigen::Vector2d place = view.camera.project(point);
      const double expected = 1000.0 * place.y() + place.x();
      // Values reach 5e5; single precision holds 0.03 there.
      EXPECT_NEAR(prepared.attenuation.at(u, v), expected, 0.07) << u << ", " << v;
    }
  }
}

TEST(ViewPreparationTest, SmallImagesPassUnchanged) {
  const XrayFrame view = numbered({60, 50, 200, 210, 29, 26});
  const PreparedView prepared = prepareView(view, sphere({0, 0, 800}, 200.0), 1);
  EXPECT_TRUE(prepared.camera == view.camera);
  EXPECT_EQ(prepared.attenuation.pixels, view.attenuation.values().pixels);
  EXPECT_EQ(prepared.weight.pixels, std::vector<float>(3000, 1.0F));
}

TEST(ViewPreparationTest, CropsToTheSphere) {
  const XrayFrame view = numbered({480, 400, 1000, 990, 230, 210});
  const Eigen::Vector3d centre(60, -40, 900);
  const double radius = 80.0;
  const PreparedView prepared = prepareView(view, sphere(centre, radius), 1);
  expectSizes(prepared);
  expectSameRays(view, prepared);
  EXPECT_LT(prepared.camera.width, 230);  // The sphere's diameter is 180 pixels.
  EXPECT_LT(prepared.camera.height, 230);
  EXPECT_EQ(prepared.camera.fx, view.camera.fx);
  EXPECT_EQ(prepared.camera.fy, view.camera.fy);
}

TEST(ViewPreparationTest, TheWholeSphereStaysInTheCrop) {
  // Off the axis a sphere's outline is wider than at the middle, and lies outwards.
  const XrayFrame view = numbered({900, 900, 700, 700, 449.5, 449.5});
  for (const Eigen::Vector3d& centre :
       {Eigen::Vector3d(0, 0, 700), Eigen::Vector3d(150, 0, 600), Eigen::Vector3d(-120, 160, 650)}) {
    const double radius = 150.0;
    const PreparedView prepared = prepareView(view, sphere(centre, radius), 1);
    ASSERT_LT(prepared.camera.width, 900);
    for (int i = 0; i < 2000; ++i) {
      // Points all over the sphere, by the golden angle.
      const double z = -1.0 + (2.0 * i + 1.0) / 2000.0;
      const double angle = 2.399963 * i;
      const double ring = std::sqrt(1.0 - z * z);
      const Eigen::Vector3d point =
          centre + radius * Eigen::Vector3d(ring * std::cos(angle), ring * std::sin(angle), z);
      const Eigen::Vector2d pixel = prepared.camera.project(point);
      // A pixel reaches half a pixel beyond its centre; a pixel of tolerance for the window's rounding.
      EXPECT_GT(pixel.x(), -1.0) << centre.transpose();
      EXPECT_GT(pixel.y(), -1.0) << centre.transpose();
      EXPECT_LT(pixel.x(), prepared.camera.width) << centre.transpose();
      EXPECT_LT(pixel.y(), prepared.camera.height) << centre.transpose();
    }
  }
}

TEST(ViewPreparationTest, ALongThingsCropIsThatOfItsBox) {
  const XrayFrame view = numbered({480, 400, 1000, 1000, 239.5, 199.5});
  ShadowBounds bounds = sphere({0, 0, 1000}, 200.0);
  for (const double x : {-30.0, 30.0}) {
    for (const double y : {-110.0, 110.0}) {
      for (const double z : {990.0, 1010.0}) bounds.corners_mm.emplace_back(x, y, z);
    }
  }
  bounds.margin_mm = 10.0;
  const PreparedView prepared = prepareView(view, bounds, 1);
  expectSizes(prepared);
  expectSameRays(view, prepared);
  // 60 mm and twice the margin, at the nearest corner: (60 + 20) / 980 of 1000 pixels.
  EXPECT_NEAR(prepared.camera.width, 82, 4);
  EXPECT_NEAR(prepared.camera.height, 245, 4);
  // Every point within the margin of the box is in the crop.
  for (const Eigen::Vector3d& corner : bounds.corners_mm) {
    for (const double s : {-1.0, 1.0}) {
      const Eigen::Vector2d pixel = prepared.camera.project(corner + Eigen::Vector3d(7 * s, 5 * s, -5));
      EXPECT_GT(pixel.x(), -1.0);
      EXPECT_LT(pixel.x(), prepared.camera.width);
      EXPECT_GT(pixel.y(), -1.0);
      EXPECT_LT(pixel.y(), prepared.camera.height);
    }
  }
}

TEST(ViewPreparationTest, SpheresBeyondTheBorderAreCutAtIt) {
  const XrayFrame view = numbered({400, 400, 1000, 1000, 199.5, 199.5});
  const PreparedView prepared = prepareView(view, sphere({150, 0, 1000}, 100.0), 1);
  expectSizes(prepared);
  expectSameRays(view, prepared);
  EXPECT_LE(prepared.camera.width, 160);
}

TEST(ViewPreparationTest, CropsThatGainNothingAreNotMade) {
  const XrayFrame view = numbered({300, 300, 500, 500, 149.5, 149.5});
  const auto unchanged = [&](const Eigen::Vector3d& centre, double radius) {
    const PreparedView prepared = prepareView(view, sphere(centre, radius), 1);
    EXPECT_TRUE(prepared.camera == view.camera) << centre.transpose() << " radius " << radius;
    EXPECT_EQ(prepared.attenuation.pixels, view.attenuation.values().pixels);
  };
  unchanged({0, 0, 500}, 140.0);   // Most of the image.
  unchanged({0, 0, 800}, 10.0);    // Too few pixels for the solver's levels.
  unchanged({900, 0, 500}, 60.0);  // Outside the image.
  unchanged({0, 0, 100}, 95.0);    // Nearly around the source.
  unchanged({0, 0, -500}, 60.0);   // Behind it.
  unchanged({0, 0, std::nan("")}, 60.0);
}

TEST(ViewPreparationTest, BinnedImagesKeepTheirRays) {
  const XrayFrame view = numbered({401, 300, 900, 880, 201, 148});
  for (const int binning : {2, 3, 5, 8}) {
    const PreparedView prepared = prepareView(view, sphere({0, 0, 700}, 1e4), binning);
    expectSizes(prepared);
    expectSameRays(view, prepared);
    EXPECT_EQ(prepared.camera.width, 401 / binning);
    EXPECT_EQ(prepared.camera.height, 300 / binning);
  }
}

TEST(ViewPreparationTest, CropsFirstThenBins) {
  const XrayFrame view = numbered({480, 480, 1000, 1000, 239.5, 239.5});
  const PreparedView prepared = prepareView(view, sphere({10, 20, 1000}, 110.0), 2);
  expectSizes(prepared);
  expectSameRays(view, prepared);
  EXPECT_NEAR(prepared.camera.fx, 500.0, 1e-9);
  EXPECT_NEAR(prepared.camera.width, 111, 2);  // The sphere's 221 pixels, halved.
}

TEST(ViewPreparationTest, MasksBecomeWeightsAtTheirPlace) {
  XrayFrame view = numbered({480, 400, 1000, 1000, 239.5, 199.5});
  view.mask = MaskImage(480, 400, 255);
  const auto masked = [](double u, double v) { return u >= 200.0 && u < 240.0 && v >= 160.0 && v < 190.0; };
  for (int v = 0; v < 400; ++v) {
    for (int u = 0; u < 480; ++u) {
      if (masked(u, v)) view.mask.at(u, v) = 0;
    }
  }
  for (const int binning : {1, 2}) {
    const PreparedView prepared = prepareView(view, sphere({0, 0, 1000}, 110.0), binning);
    expectSizes(prepared);
    int left_out = 0;
    for (int v = 0; v < prepared.camera.height; ++v) {
      for (int u = 0; u < prepared.camera.width; ++u) {
        const Eigen::Vector2d place = view.camera.project(prepared.camera.rayDirection(u, v));
        // Blocks on the mask's border may go either way.
        const bool deep_inside = masked(place.x() - 2, place.y() - 2) && masked(place.x() + 2, place.y() + 2);
        const bool near = masked(place.x() - 2, place.y()) || masked(place.x() + 2, place.y()) ||
                          masked(place.x(), place.y() - 2) || masked(place.x(), place.y() + 2);
        if (deep_inside) {
          EXPECT_EQ(prepared.weight.at(u, v), 0.0F) << place.transpose();
        }
        if (!near && !masked(place.x(), place.y())) {
          EXPECT_EQ(prepared.weight.at(u, v), 1.0F) << place.transpose();
        }
        left_out += prepared.weight.at(u, v) == 0.0F;
      }
    }
    EXPECT_GT(left_out, 100);
  }
}

TEST(ViewPreparationTest, BinningLeavesATile) {
  const XrayFrame view = numbered({401, 300, 900, 880, 201, 148});
  for (const int binning : {38, 300, 100000}) {
    const PreparedView prepared = prepareView(view, sphere({0, 0, 700}, 1e4), binning);
    expectSizes(prepared);
    expectSameRays(view, prepared);
    EXPECT_GE(prepared.camera.height, 8);
  }
  const XrayFrame tiny = numbered({5, 3, 900, 880, 2, 1});
  EXPECT_EQ(prepareView(tiny, sphere({0, 0, 700}, 1e4), 4).attenuation.pixels, tiny.attenuation.values().pixels);
}

TEST(ViewPreparationTest, ValuesWithoutWeightAreHidden) {
  XrayFrame view;
  view.camera = {64, 64, 500, 500, 31.5, 31.5};
  view.attenuation = FloatImage(64, 64, 1.0F);
  view.mask = MaskImage(64, 64, 255);
  view.attenuation.floats().at(0, 0) = 1e30F;
  view.mask.at(0, 0) = 0;
  view.attenuation.floats().at(9, 9) = 3.0F;
  const PreparedView prepared = prepareView(view, sphere({0, 0, 700}, 1e4), 1);
  EXPECT_EQ(prepared.weight.at(0, 0), 0.0F);
  EXPECT_NEAR(prepared.attenuation.at(0, 0), 1.0 + 2.0 / 4095.0, 1e-6);
  EXPECT_EQ(prepared.attenuation.at(9, 9), 3.0F);
  view.mask = MaskImage(64, 64, 0);
  for (const float pixel : prepareView(view, sphere({0, 0, 700}, 1e4), 1).attenuation.pixels) ASSERT_EQ(pixel, 0.0F);
}

TEST(ViewPreparationTest, MaskedPixelsLeaveNoTraceInBins) {
  XrayFrame view;
  view.camera = {200, 200, 500, 500, 99.5, 99.5};
  view.attenuation = FloatImage(200, 200, 1.0F);
  view.mask = MaskImage(200, 200, 255);
  for (int i = 0; i < 200; ++i) {
    view.attenuation.floats().at(i, 77) = 40.0F;  // A wire.
    view.mask.at(i, 77) = 0;
  }
  const PreparedView prepared = prepareView(view, sphere({0, 0, 700}, 1e4), 2);
  ASSERT_EQ(prepared.camera.width, 100);
  EXPECT_EQ(prepared.attenuation.pixels, std::vector<float>(10000, 1.0F));
  EXPECT_EQ(prepared.weight.pixels, std::vector<float>(10000, 1.0F));  // Half a block is enough.
}

}  // namespace
}  // namespace xray_registration
