#include "xray_registration/image/xray_frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>

#include "test/image/distorted_grids.h"

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

TEST(XrayFrame, CountsAreWorthWhatTheSameFloatsAre) {
  FloatImage floats = transmission(40000.0);
  floats.at(10, 10) = 0.0F;  // Below the floor.
  floats.at(20, 20) = 65535.0F;
  CountImage counts(64, 48);
  for (std::size_t i = 0; i < counts.pixels.size(); ++i) {
    floats.pixels[i] = std::round(floats.pixels[i]);
    counts.pixels[i] = static_cast<std::uint16_t>(floats.pixels[i]);
  }
  for (const ImageKind kind : {ImageKind::kTransmission, ImageKind::kAttenuation, ImageKind::kInverted}) {
    for (const double open_field : {0.0, 30000.0}) {
      for (const double saturation : {kMono16, 4000.0, 0.0}) {
        LinearizeOptions options{kind, open_field};
        const XrayFrame of_counts = makeXrayFrame(counts, saturation, calibration(), options);
        const XrayFrame of_floats = makeXrayFrame(floats, saturation, calibration(), options);
        EXPECT_NE(of_counts.attenuation.counts(), nullptr) << "no image of floats";
        EXPECT_EQ(of_counts.mask.pixels, of_floats.mask.pixels);
        for (std::size_t i = 0; i < counts.pixels.size(); ++i) {
          // The same arithmetic, in vectors or at their end: the last digit of log(40000) ≈ 10.6 may differ.
          ASSERT_NEAR(of_counts.attenuation.values().pixels[i], of_floats.attenuation.values().pixels[i], 2e-6);
        }
      }
    }
  }
  Calibration distorted = calibration();
  distorted.distortion_model = "plumb_bob";
  distorted.distortion = {0.1, 0.0, 0.0, 0.0, 0.0};
  const FloatImage straight = makeXrayFrame(counts, kMono16, distorted, {}).attenuation.values();
  const FloatImage expected = makeXrayFrame(floats, kMono16, distorted, {}).attenuation.values();
  for (std::size_t i = 0; i < straight.pixels.size(); ++i) ASSERT_NEAR(straight.pixels[i], expected.pixels[i], 1e-5);
}

TEST(XrayFrame, CountsThatCarryNoPictureAreRefused) {
  EXPECT_THROW(makeXrayFrame(CountImage(64, 48, 300), kMono16, calibration(), {}), FrameError);
  EXPECT_THROW(makeXrayFrame(CountImage(), kMono16, calibration(), {}), FrameError);
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
    EXPECT_TRUE(allFinite(frame.attenuation.values()));
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
  EXPECT_EQ(floats.attenuation.values().pixels, image.pixels) << "line integrals are taken as they are";
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
  EXPECT_TRUE(allFinite(frame.attenuation.values()));
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
  EXPECT_EQ(a.attenuation.values().pixels, b.attenuation.values().pixels);
  EXPECT_EQ(a.mask.pixels, b.mask.pixels);
}

TEST(StraightenedPixels, GiveTheSamePixelsAndAreMadeOnce) {
  Calibration c = calibration();
  c.distortion = {0.25, 0.05, 0.004, -0.003, 0.02};
  StraightenedPixels pixels;
  const FloatImage first = transmission(40000.0);
  expectSameFrame(makeXrayFrame(first, kMono16, c, {}, &pixels), makeXrayFrame(first, kMono16, c, {}));
  EXPECT_EQ(pixels.calibration.distortion, c.distortion);
  // Spoilt ones tell whether the next frame uses them.
  pixels.seen.at(30, 20) = 0;
  const FloatImage second = transmission(30000.0);
  XrayFrame expected = makeXrayFrame(second, kMono16, c, {});
  EXPECT_NE(expected.mask.at(30, 20), 0);
  expected.mask.at(30, 20) = 0;
  expectSameFrame(makeXrayFrame(second, kMono16, c, {}, &pixels), expected);
}

TEST(StraightenedPixels, FollowTheCalibration) {
  const FloatImage image = transmission(40000.0);
  Calibration c = calibration();
  c.distortion = {0.25, 0.05, 0.004, -0.003, 0.02};
  StraightenedPixels pixels;
  makeXrayFrame(image, kMono16, c, {}, &pixels);
  const auto expect_noticed = [&] {
    const std::vector<float> before = pixels.source_u.pixels;
    expectSameFrame(makeXrayFrame(image, kMono16, c, {}, &pixels), makeXrayFrame(image, kMono16, c, {}));
    EXPECT_NE(pixels.source_u.pixels, before);
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
  expectSameFrame(makeXrayFrame(part, kMono16, small, {}, &pixels), makeXrayFrame(part, kMono16, small, {}));
}

TEST(StraightenedPixels, AreNotMadeForAStraightLens) {
  StraightenedPixels pixels;
  const FloatImage image = transmission(40000.0);
  expectSameFrame(makeXrayFrame(image, kMono16, calibration(), {}, &pixels),
                  makeXrayFrame(image, kMono16, calibration(), {}));
  EXPECT_TRUE(pixels.source_u.empty());
}

/// A detector with an S-shape, and its map from marks all over its middle.
const distorted::Detector kDetector{64, 48, 2.0, 2.5};

std::shared_ptr<const UndistortionMap> detectorMap() {
  std::vector<PixelPair> pairs;
  for (int v = 4; v <= 44; v += 4) {
    for (int u = 4; u <= 60; u += 4) pairs.push_back({kDetector.rawOf({u, v}), Eigen::Vector2d(u, v)});
  }
  return std::make_shared<const UndistortionMap>(UndistortionMap::fitted(64, 48, pairs));
}

TEST(StraightenedPixels, LensAndDetectorAreOneInterpolation) {
  Calibration c = calibration();
  c.distortion = {0.25, 0.05, 0.004, -0.003, 0.02};
  const auto map = detectorMap();
  StraightenedPixels pixels;
  const FloatImage image = transmission(40000.0);
  const XrayFrame frame = makeXrayFrame(image, kMono16, c, {}, &pixels, map);
  const XrayCamera camera = cameraFromCalibration(c, 64, 48);
  double moved = 0.0;
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const Eigen::Vector3d ray = camera.rayDirection(u, v);
      const Eigen::Vector2d seen = distorted(c.distortion, ray.x(), ray.y());
      const Eigen::Vector2d straight = camera.project({seen.x(), seen.y(), 1.0});
      // Lens first, detector second; both in doubles here and with one rounding to float there: 4e-6 of 64 pixels.
      const Eigen::Vector2d raw = map->rawPixel(straight);
      ASSERT_NEAR(pixels.source_u.at(u, v), raw.x(), 1e-4) << u << ", " << v;
      ASSERT_NEAR(pixels.source_v.at(u, v), raw.y(), 1e-4) << u << ", " << v;
      const bool inside = raw.x() >= 0.0 && raw.x() <= 63.0 && raw.y() >= 0.0 && raw.y() <= 47.0;
      ASSERT_EQ(frame.mask.at(u, v) != 0, inside && map->covers(straight)) << u << ", " << v;
      moved = std::max(moved, (raw - straight).norm());
    }
  }
  EXPECT_GT(moved, 1.0) << "the detector's distortion must be worth the test";
  EXPECT_TRUE(allFinite(frame.attenuation.values()));
}

/// What a detector with this distortion shows of a scene, as floats that are taken as they are.
FloatImage seenBy(const distorted::Detector& detector, const std::function<double(const Eigen::Vector2d&)>& scene) {
  FloatImage raw(detector.width, detector.height);
  for (int v = 0; v < raw.height; ++v) {
    for (int u = 0; u < raw.width; ++u) {
      const Eigen::Vector2d straight = detector.straightOf(Eigen::Vector2d(u, v));
      raw.at(u, v) = static_cast<float>(scene(straight));
    }
  }
  return raw;
}

double smoothScene(const Eigen::Vector2d& p) { return 3.0 + 0.02 * p.x() - 0.015 * p.y() + 1e-4 * p.x() * p.y(); }

TEST(XrayFrame, ADetectorsDistortionIsUndoneAndWhatIsBeyondItsGridMasked) {
  LinearizeOptions as_it_is;
  as_it_is.kind = ImageKind::kAttenuation;
  const auto map = detectorMap();
  const FloatImage raw = seenBy(kDetector, smoothScene);
  const XrayFrame frame = makeXrayFrame(raw, 0.0, calibration(), as_it_is, nullptr, map);
  double before = 0.0;
  int covered = 0;
  for (int v = 0; v < 48; ++v) {
    for (int u = 0; u < 64; ++u) {
      const bool covers = map->covers(Eigen::Vector2d(u, v));
      covered += covers ? 1 : 0;
      const Eigen::Vector2d from = kDetector.rawOf(Eigen::Vector2d(u, v));
      const double rim_px = std::min({from.x(), from.y(), 63.0 - from.x(), 47.0 - from.y()});
      if (std::abs(rim_px) < 0.05) continue;  // The map is not the truth itself.
      ASSERT_EQ(frame.mask.at(u, v) != 0, covers && rim_px > 0.0) << u << ", " << v;
      if (frame.mask.at(u, v) == 0) continue;
      // OpenCV places its bilinear samples to 1/32 pixel: 0.016 px times 0.03 per pixel.
      ASSERT_NEAR(frame.attenuation.at(u, v), smoothScene({u, v}), 1e-3) << u << ", " << v;
      before = std::max(before, std::abs(raw.at(u, v) - smoothScene({u, v})));
    }
  }
  EXPECT_GT(before, 0.02) << "the distortion must be worth the test";
  // The grid ends four pixels before the border; a mark in its corner may have been left out.
  EXPECT_NEAR(covered, 57 * 41, 20);
}

TEST(XrayFrame, ADetectorsMapKnowsRoiAndBinning) {
  const distorted::Detector detector{128, 96, 4.0, 5.0};
  std::vector<PixelPair> pairs;
  for (int v = 0; v <= 95; v += 5) {
    for (int u = 0; u <= 127; u += 5) pairs.push_back({detector.rawOf({u, v}), Eigen::Vector2d(u, v)});
  }
  const auto map = std::make_shared<const UndistortionMap>(UndistortionMap::fitted(128, 96, pairs));
  Calibration c = calibration(128, 96);
  c.roi_x = 24;
  c.roi_y = 16;
  c.roi_width = 96;
  c.roi_height = 64;
  c.binning_x = 2;
  c.binning_y = 4;
  // The detector sees the smooth scene and hands out means of its blocks.
  const FloatImage sensor = seenBy(detector, smoothScene);
  FloatImage part(48, 16);
  for (int v = 0; v < 16; ++v) {
    for (int u = 0; u < 48; ++u) {
      double sum = 0.0;
      for (int i = 0; i < 8; ++i) sum += sensor.at(24 + 2 * u + i % 2, 16 + 4 * v + i / 2);
      part.at(u, v) = static_cast<float>(sum / 8.0);
    }
  }
  LinearizeOptions as_it_is;
  as_it_is.kind = ImageKind::kAttenuation;
  const XrayFrame frame = makeXrayFrame(part, 0.0, c, as_it_is, nullptr, map);
  int used = 0;
  for (int v = 0; v < 16; ++v) {
    for (int u = 0; u < 48; ++u) {
      if (frame.mask.at(u, v) == 0) continue;
      ++used;
      // Steps of a binned pixel are up to 0.1, placed to 1/32 pixel.
      ASSERT_NEAR(frame.attenuation.at(u, v), smoothScene({24 + 2 * u + 0.5, 16 + 4 * v + 1.5}), 2.5e-3)
          << u << ", " << v;
    }
  }
  EXPECT_GT(used, 500);
}

TEST(XrayFrame, AMapOfAnotherSensorIsRefusedWithBothSizes) {
  Calibration c = calibration(128, 48);
  c.binning_x = 2;  // The image has the map's size, the sensor has not.
  const auto make = [&] { makeXrayFrame(transmission(1000.0), kMono16, c, {}, nullptr, detectorMap()); };
  expectError("128 × 48", make);
  expectError("64 × 48", make);
  expectError("image/undistortion_map", make);
}

TEST(StraightenedPixels, FollowTheMap) {
  const FloatImage image = transmission(40000.0);
  StraightenedPixels pixels;
  const auto first = detectorMap();
  expectSameFrame(makeXrayFrame(image, kMono16, calibration(), {}, &pixels, first),
                  makeXrayFrame(image, kMono16, calibration(), {}, nullptr, first));
  pixels.seen.at(30, 20) = 0;  // Tells whether the next frame uses them.
  EXPECT_EQ(makeXrayFrame(image, kMono16, calibration(), {}, &pixels, first).mask.at(30, 20), 0);
  const auto second = detectorMap();
  EXPECT_NE(makeXrayFrame(image, kMono16, calibration(), {}, &pixels, second).mask.at(30, 20), 0);
  EXPECT_EQ(makeXrayFrame(image, kMono16, calibration(), {}, &pixels).attenuation.values().pixels,
            makeXrayFrame(image, kMono16, calibration(), {}).attenuation.values().pixels);
}

}  // namespace
}  // namespace xray_registration
