#include "xray_registration/image/xray_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

namespace xray_registration {
namespace {

constexpr double kMono16 = 65535.0;

Calibration calibration(int width = 64, int height = 48) {
  Calibration c;
  c.width = width;
  c.height = height;
  c.k = {100.0, 0.0, 31.0, 0.0, 98.0, 24.0, 0.0, 0.0, 1.0};
  c.distortion_model = "plumb_bob";
  c.distortion = {0, 0, 0, 0, 0};
  return c;
}

/// What a transmission with a known attenuation looks like: 0 in an open stripe, growing to the right.
double trueAttenuation(double u) { return u < 8.0 ? 0.0 : 0.05 * (u - 8.0); }

FloatImage transmission(double open_field) {
  FloatImage image(64, 48);
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u) image.at(u, v) = static_cast<float>(open_field * std::exp(-trueAttenuation(u)));
  return image;
}

std::string errorOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const FrameError& error) {
    return error.what();
  }
  return "no error";
}

void expectError(const std::string& expected, const std::function<void()>& call) {
  const std::string text = errorOf(call);
  EXPECT_NE(text.find(expected), std::string::npos) << "said: " << text;
}

bool allFinite(const FloatImage& image) {
  return std::all_of(image.pixels.begin(), image.pixels.end(), [](float value) { return std::isfinite(value); });
}

TEST(CameraFromCalibration, TakesKAsItIs) {
  EXPECT_EQ(cameraFromCalibration(calibration(), 64, 48), (XrayCamera{64, 48, 100.0, 98.0, 31.0, 24.0}));
}

TEST(CameraFromCalibration, RoiAndBinningSeeTheSameRays) {
  const XrayCamera full{400, 300, 500.0, 510.0, 199.0, 148.0};
  Calibration c = calibration(400, 300);
  c.k = {full.fx, 0, full.cx, 0, full.fy, full.cy, 0, 0, 1};
  c.roi_x = 100;
  c.roi_y = 40;
  c.roi_width = 120;
  c.roi_height = 80;
  c.binning_x = 4;
  c.binning_y = 2;
  const XrayCamera camera = cameraFromCalibration(c, 30, 40);
  // Pixel (3, 5) is the mean of columns 112…115 and rows 50, 51 of the sensor.
  EXPECT_LT((camera.rayDirection(3, 5) - full.rayDirection(113.5, 50.5)).norm(), 1e-12);
  c.binning_x = c.binning_y = 0;  // As drivers leave it.
  EXPECT_EQ(cameraFromCalibration(c, 120, 80), full.cropped(100, 40, 120, 80));
}

TEST(CameraFromCalibration, SaysWhatIsWrong) {
  const auto with = [](const std::function<void(Calibration*)>& change) {
    return [change] {
      Calibration c = calibration();
      change(&c);
      cameraFromCalibration(c, 64, 48);
    };
  };
  EXPECT_EQ(errorOf(with([](Calibration*) {})), "no error");
  expectError("K[0] = 0", with([](Calibration* c) { c->k[0] = 0.0; }));
  expectError("K[4] = -3", with([](Calibration* c) { c->k[4] = -3.0; }));
  expectError("not finite", with([](Calibration* c) { c->k[2] = std::nan(""); }));
  expectError("skew", with([](Calibration* c) { c->k[1] = 0.5; }));
  expectError("not a camera matrix", with([](Calibration* c) { c->k[8] = 0.0; }));
  expectError("0 × 48", with([](Calibration* c) { c->width = 0; }));
  expectError("but the image is 64 × 48", with([](Calibration* c) { c->width = 65; }));
  expectError("the ROI of 10 × 10 at (60, 0)", with([](Calibration* c) {
                c->roi_x = 60;
                c->roi_width = c->roi_height = 10;
              }));
  expectError("binning_y is -1", with([](Calibration* c) { c->binning_y = -1; }));
  expectError("'equidistant'", with([](Calibration* c) {
                c->distortion_model = "equidistant";
                c->distortion = {0.1, 0, 0, 0};
              }));
  expectError("3 coefficients", with([](Calibration* c) { c->distortion = {0.1, 0, 0}; }));
  expectError("D holds", with([](Calibration* c) { c->distortion[1] = INFINITY; }));
}

TEST(XrayFrame, TransmissionBecomesAttenuation) {
  LinearizeOptions options;
  options.open_field = 40000.0;
  const XrayFrame frame = makeXrayFrame(transmission(40000.0), kMono16, calibration(), options);
  for (int v = 0; v < 48; ++v) {
    // Floats of log(40000) ≈ 10.6 round by 1e-6.
    for (int u = 0; u < 64; ++u) ASSERT_NEAR(frame.attenuation.at(u, v), trueAttenuation(u), 3e-6);
  }
  EXPECT_EQ(std::count(frame.mask.pixels.begin(), frame.mask.pixels.end(), 0), 0);
}

TEST(XrayFrame, OpenFieldIsFoundAndSteady) {
  std::mt19937_64 random(5);
  double lowest = 1e9;
  double highest = 0.0;
  for (int frame = 0; frame < 20; ++frame) {
    FloatImage image = transmission(40000.0);
    for (float& value : image.pixels) value += std::normal_distribution<float>(0.0F, 200.0F)(random);
    const double found = estimateOpenField(image, kMono16);
    lowest = std::min(lowest, found);
    highest = std::max(highest, found);
  }
  // 384 open pixels with 0.5 % noise; the percentile is the 15th brightest, about 1.8 standard deviations up.
  EXPECT_NEAR(0.5 * (lowest + highest), 40000.0 + 1.8 * 200.0, 200.0);
  // A mean of such ranks varies by a fifth of the noise; 20 draws span about four times that.
  EXPECT_LT(highest - lowest, 200.0);
}

TEST(XrayFrame, SaturatedPixelsDoNotSetTheOpenField) {
  FloatImage image = transmission(40000.0);
  for (int v = 0; v < 20; ++v)
    for (int u = 0; u < 20; ++u) image.at(u, v) = 65535.0F;
  EXPECT_NEAR(estimateOpenField(image, kMono16), 40000.0, 1.0);
  const XrayFrame frame = makeXrayFrame(image, kMono16, calibration(), {});
  EXPECT_LT(frame.attenuation.at(0, 0), 0.0F);
  EXPECT_NE(frame.mask.at(0, 0), 0);
  std::fill(image.pixels.begin() + 4, image.pixels.end(), 65535.0F);
  EXPECT_EQ(estimateOpenField(image, kMono16), kMono16) << "nearly everything is saturated";
}

TEST(XrayFrame, ZeroAndNegativePixelsStayFinite) {
  FloatImage image = transmission(40000.0);
  image.at(10, 10) = 0.0F;
  image.at(11, 10) = -25.0F;
  for (const double saturation : {kMono16, 0.0, static_cast<double>(INFINITY)}) {
    const XrayFrame frame = makeXrayFrame(image, saturation, calibration(), {});
    EXPECT_TRUE(allFinite(frame.attenuation));
    EXPECT_EQ(frame.attenuation.at(10, 10), frame.attenuation.at(11, 10));
    EXPECT_GT(frame.attenuation.at(10, 10), 10.0F) << "dark must stay darker than any patient";
  }
}

TEST(XrayFrame, InvertedImageIsTheSameXray) {
  FloatImage inverted = transmission(200.0);
  for (float& value : inverted.pixels) value = 255.0F - value;
  LinearizeOptions options;
  options.open_field = 200.0;
  options.kind = ImageKind::kInverted;
  const XrayFrame frame = makeXrayFrame(inverted, 255.0, calibration(), options);
  // 255 − (255 − x) loses what floats near 255 cannot hold: 1.5e-5 of intensities above 10.
  for (int u = 0; u < 64; ++u) ASSERT_NEAR(frame.attenuation.at(u, 0), trueAttenuation(u), 3e-6);
}

TEST(XrayFrame, TwelveBitsInSixteenInvertAboutTheirOwnFullScale) {
  FloatImage inverted = transmission(4000.0);
  for (float& value : inverted.pixels) value = 4095.0F - value;
  LinearizeOptions options;
  options.open_field = 4000.0;
  options.kind = ImageKind::kInverted;
  const XrayFrame frame = makeXrayFrame(inverted, kMono16, calibration(), options);
  for (int u = 0; u < 64; ++u) ASSERT_NEAR(frame.attenuation.at(u, 0), trueAttenuation(u), 3e-6);
}

TEST(XrayFrame, AttenuationStaysLinear) {
  FloatImage image(64, 48);
  for (int v = 0; v < 48; ++v)
    for (int u = 0; u < 64; ++u) image.at(u, v) = static_cast<float>(100 * u);
  LinearizeOptions options;
  options.kind = ImageKind::kAttenuation;
  const XrayFrame floats = makeXrayFrame(image, 0.0, calibration(), options);
  EXPECT_EQ(floats.attenuation.pixels, image.pixels) << "line integrals are taken as they are";
  const XrayFrame integers = makeXrayFrame(image, kMono16, calibration(), options);
  // 6300 needs 13 bits: full scale 8191.
  EXPECT_FLOAT_EQ(integers.attenuation.at(63, 0), 8.0F * 6300.0F / 8191.0F);
}

TEST(XrayFrame, RefusesPicturesThatAreNone) {
  const auto make = [](const FloatImage& image) {
    return [image] { makeXrayFrame(image, kMono16, calibration(), {}); };
  };
  expectError("constant: every pixel is 7", make(FloatImage(64, 48, 7.0F)));
  FloatImage image = transmission(1000.0);
  image.at(3, 3) = std::numeric_limits<float>::quiet_NaN();
  image.at(4, 3) = std::numeric_limits<float>::infinity();
  expectError("2 pixels that are NaN or infinite", make(image));
  image = transmission(1000.0);
  for (float& value : image.pixels) value -= 2000.0F;
  expectError("not positive", make(image));
  image = transmission(1000.0);
  image.pixels.pop_back();
  expectError("do not fill", make(image));
  expectError("no pixels", make(FloatImage()));
  expectError("image/open_field is -1", [] {
    LinearizeOptions options;
    options.open_field = -1.0;
    makeXrayFrame(transmission(1000.0), kMono16, calibration(), options);
  });
}

/// Normalised coordinates after lens distortion, from OpenCV's published formula.
Eigen::Vector2d distorted(const std::vector<double>& d, double x, double y) {
  const double r2 = x * x + y * y;
  const auto at = [&](std::size_t i) { return i < d.size() ? d[i] : 0.0; };
  const double radial = (1 + r2 * (at(0) + r2 * (at(1) + r2 * at(4)))) / (1 + r2 * (at(5) + r2 * (at(6) + r2 * at(7))));
  return {x * radial + 2 * at(2) * x * y + at(3) * (r2 + 2 * x * x),
          y * radial + at(2) * (r2 + 2 * y * y) + 2 * at(3) * x * y};
}

void expectUndistorted(const Calibration& c) {
  const XrayCamera camera = cameraFromCalibration(c, 64, 48);
  // The detector saw a scene that is smooth in ideal ray directions, through the lens.
  const auto scene = [](double x, double y) { return 3.0 + 2.0 * x - 1.5 * y + x * y; };
  FloatImage raw(64, 48);
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const Eigen::Vector3d seen = camera.rayDirection(u, v);
      Eigen::Vector2d ideal = seen.head<2>();
      for (int i = 0; i < 50; ++i) ideal += seen.head<2>() - distorted(c.distortion, ideal.x(), ideal.y());
      raw.at(u, v) = static_cast<float>(scene(ideal.x(), ideal.y()));
    }
  }
  LinearizeOptions options;
  options.kind = ImageKind::kAttenuation;
  const XrayFrame frame = makeXrayFrame(raw, 0.0, c, options);
  int masked = 0;
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const Eigen::Vector3d ray = camera.rayDirection(u, v);
      const Eigen::Vector2d seen = distorted(c.distortion, ray.x(), ray.y());
      const Eigen::Vector2d pixel = camera.project({seen.x(), seen.y(), 1.0});
      const bool inside = pixel.x() >= 0 && pixel.x() <= 63 && pixel.y() >= 0 && pixel.y() <= 47;
      ASSERT_EQ(frame.mask.at(u, v) != 0, inside) << u << ", " << v;
      masked += inside ? 0 : 1;
      // OpenCV places its bilinear samples to 1/32 pixel: 0.016 px times 0.03 per pixel.
      if (inside) {
        ASSERT_NEAR(frame.attenuation.at(u, v), scene(ray.x(), ray.y()), 1e-3) << u << ", " << v;
      }
    }
  }
  EXPECT_GT(masked, 20) << "this lens must look past the image's border for the test to mean anything";
  EXPECT_TRUE(allFinite(frame.attenuation));
}

TEST(XrayFrame, PlumbBobIsUndistortedAndWhatWasNotSeenIsMasked) {
  Calibration c = calibration();
  c.distortion = {0.25, 0.05, 0.004, -0.003, 0.02};
  expectUndistorted(c);
}

TEST(XrayFrame, RationalPolynomialIsUndistorted) {
  Calibration c = calibration();
  c.distortion_model = "rational_polynomial";
  c.distortion = {0.4, 0.05, 0.002, -0.003, 0.01, 0.1, 0.02, 0.005};
  expectUndistorted(c);
}

void expectSameFrame(const XrayFrame& a, const XrayFrame& b) {
  EXPECT_EQ(a.camera, b.camera);
  EXPECT_EQ(a.attenuation.pixels, b.attenuation.pixels);
  EXPECT_EQ(a.mask.pixels, b.mask.pixels);
}

TEST(UndistortionMaps, GiveTheSamePixelsAndAreMadeOnce) {
  Calibration c = calibration();
  c.distortion = {0.25, 0.05, 0.004, -0.003, 0.02};
  UndistortionMaps maps;
  const FloatImage first = transmission(40000.0);
  expectSameFrame(makeXrayFrame(first, kMono16, c, {}, &maps), makeXrayFrame(first, kMono16, c, {}));
  EXPECT_EQ(maps.distortion, c.distortion);
  // Spoilt maps tell whether the next frame uses them.
  maps.seen.at(30, 20) = 0;
  const FloatImage second = transmission(30000.0);
  XrayFrame expected = makeXrayFrame(second, kMono16, c, {});
  EXPECT_NE(expected.mask.at(30, 20), 0);
  expected.mask.at(30, 20) = 0;
  expectSameFrame(makeXrayFrame(second, kMono16, c, {}, &maps), expected);
}

TEST(UndistortionMaps, FollowTheCalibration) {
  const FloatImage image = transmission(40000.0);
  Calibration c = calibration();
  c.distortion = {0.25, 0.05, 0.004, -0.003, 0.02};
  UndistortionMaps maps;
  makeXrayFrame(image, kMono16, c, {}, &maps);
  const auto expect_noticed = [&] {
    const std::vector<float> before = maps.source_u.pixels;
    expectSameFrame(makeXrayFrame(image, kMono16, c, {}, &maps), makeXrayFrame(image, kMono16, c, {}));
    EXPECT_NE(maps.source_u.pixels, before);
  };
  c.distortion[2] = 0.008;
  expect_noticed();
  c.k[0] = 110.0;
  expect_noticed();
  c.distortion_model = "rational_polynomial";
  c.distortion = {0.4, 0.05, 0.002, -0.003, 0.01, 0.1, 0.02, 0.005};
  expect_noticed();
  // Another size with the same lens.
  Calibration small = c;
  small.roi_width = 60;
  small.roi_height = 40;
  FloatImage part(60, 40);
  for (int v = 0; v < 40; ++v) std::copy_n(&image.at(0, v), 60, &part.at(0, v));
  expectSameFrame(makeXrayFrame(part, kMono16, small, {}, &maps), makeXrayFrame(part, kMono16, small, {}));
}

TEST(UndistortionMaps, AreNotMadeForAStraightLens) {
  UndistortionMaps maps;
  const FloatImage image = transmission(40000.0);
  expectSameFrame(makeXrayFrame(image, kMono16, calibration(), {}, &maps),
                  makeXrayFrame(image, kMono16, calibration(), {}));
  EXPECT_TRUE(maps.source_u.empty());
}

}  // namespace
}  // namespace xray_registration
