#include "xray_registration/image/undistortion_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>
#include <string>

#include "test/image/distorted_grids.h"
#include "test/volume/test_files.h"

namespace xray_registration {
namespace {

using distorted::Detector;
using test_files::TemporaryFolder;

/// An image intensifier's S-shape and pincushion, in a round field.
Detector detector() { return {512, 480, 9.0, 14.0}; }

std::vector<PixelPair> marks(double noise_px = 0.0) {
  distorted::Grid grid;
  grid.pitch_px = 20.0;
  grid.angle_rad = 0.2;
  grid.field_radius_px = 235.0;
  std::vector<PixelPair> pairs = distorted::marksOf(grid, detector());
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (PixelPair& pair : pairs) pair.raw += noise_px * Eigen::Vector2d(normal(random), normal(random));
  return pairs;
}

UndistortionMap mapOf(const std::vector<PixelPair>& pairs, UndistortionFit* fit = nullptr) {
  return UndistortionMap::fitted(detector().width, detector().height, pairs, fit);
}

/// Largest and rms distance of the map from the truth where it is known.
PixelResidual errorOf(const UndistortionMap& map) {
  PixelResidual error;
  int count = 0;
  for (int v = 0; v < map.height(); v += 3) {
    for (int u = 0; u < map.width(); u += 3) {
      const Eigen::Vector2d straight(u, v);
      if (!map.covers(straight)) continue;
      const double distance = (map.rawPixel(straight) - detector().rawOf(straight)).norm();
      error.rms_px += distance * distance;
      error.max_px = std::max(error.max_px, distance);
      ++count;
    }
  }
  EXPECT_GT(count, 10000);
  error.rms_px = std::sqrt(error.rms_px / std::max(count, 1));
  return error;
}

std::string errorTextOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const UndistortionMapError& error) {
    return error.what();
  }
  return "no error";
}

TEST(UndistortionMap, RecoversSShapeAndPincushion) {
  UndistortionFit fit;
  const UndistortionMap map = mapOf(marks(), &fit);
  EXPECT_GT(fit.before.max_px, 10.0) << "the distortion must be worth the test";
  // Sines of the twist and the inverse of the pincushion are no polynomials; to degree 9 they are to a hundredth.
  EXPECT_LT(errorOf(map).max_px, 0.02);
  EXPECT_EQ(fit.points_used, static_cast<int>(marks().size()));
  EXPECT_LT(fit.after.max_px, 0.02);
}

TEST(UndistortionMap, AveragesTheMarksNoise) {
  constexpr double kNoise = 0.15;
  UndistortionFit fit;
  const std::vector<PixelPair> noisy = marks(kNoise);
  const UndistortionMap map = mapOf(noisy, &fit);
  // A fit of T terms to N marks keeps √(T / N) of their noise: of degree 5 (21 terms) and 340 marks 25 %, in both
  // coordinates together 0.05 px; twice that is allowed for the degree that chance chooses. At the rim it is more.
  ASSERT_GT(noisy.size(), 300U);
  const PixelResidual error = errorOf(map);
  EXPECT_LT(error.rms_px, 0.1);
  EXPECT_LT(error.max_px, 0.4);
  // What is left over is the noise itself.
  EXPECT_NEAR(fit.after.rms_px, std::sqrt(2.0) * kNoise, 0.03);
  EXPECT_GE(fit.cross_validated_rms_px, fit.after.rms_px);
  EXPECT_LE(map.degree(), 7);
}

TEST(UndistortionMap, AStraightDetectorGetsTheLowestDegree) {
  std::vector<PixelPair> pairs = marks();
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0.0, 0.1);
  for (PixelPair& pair : pairs) pair.raw = pair.straight + Eigen::Vector2d(normal(random), normal(random));
  EXPECT_EQ(mapOf(pairs).degree(), 1);
}

TEST(UndistortionMap, MarksThatContradictTheOthersAreLeftOut) {
  std::vector<PixelPair> pairs = marks(0.1);
  std::vector<bool> spoilt(pairs.size(), false);
  for (std::size_t i = 5; i < pairs.size(); i += 20) {
    pairs[i].raw += Eigen::Vector2d(3.0, -2.0);
    spoilt[i] = true;
  }
  UndistortionFit fit;
  const UndistortionMap map = mapOf(pairs, &fit);
  ASSERT_EQ(fit.used.size(), pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (spoilt[i]) {
      EXPECT_FALSE(fit.used[i]) << "mark " << i;
    }
  }
  // Of a normal error's lengths 4 in a million are beyond five standard deviations.
  EXPECT_GE(fit.points_used, static_cast<int>(pairs.size() * 95 / 100) - 2);
  EXPECT_LT(errorOf(map).max_px, 0.4);
}

TEST(UndistortionMap, IsKnownInsideTheHullAndTameOutside) {
  const std::vector<PixelPair> pairs = marks();
  const UndistortionMap map = mapOf(pairs);
  for (const PixelPair& pair : pairs) {
    const Eigen::Vector2d inwards = (detector().middle() - pair.straight).normalized();
    EXPECT_TRUE(map.covers(pair.straight + 1e-3 * inwards));
  }
  EXPECT_FALSE(map.covers({2.0, 2.0}));
  EXPECT_FALSE(map.covers({255.0, -1.0}));
  // Nowhere in the picture and far around does it move more than at the marks, but for what lies between these.
  double most = 0.0;
  for (const PixelPair& pair : pairs) most = std::max(most, (pair.raw - pair.straight).norm());
  for (int v = -600; v < 1100; v += 50) {
    for (int u = -600; u < 1100; u += 50) {
      const Eigen::Vector2d straight(u, v);
      EXPECT_LT((map.rawPixel(straight) - straight).norm(), 1.05 * most) << u << ", " << v;
    }
  }
  // No step at the hull's edge.
  Eigen::Vector2d rim = detector().middle();
  while (map.covers(rim)) rim.x() += 0.01;
  EXPECT_LT((map.rawPixel(rim) - map.rawPixel(rim - Eigen::Vector2d(0.02, 0.0))).norm(), 0.03);
}

TEST(UndistortionMap, RefusesPointsThatMakeNone) {
  std::vector<PixelPair> pairs = marks();
  pairs.resize(11);
  EXPECT_NE(errorTextOf([&] { mapOf(pairs); }).find("11 points are too few"), std::string::npos);
  std::vector<PixelPair> line;
  for (int i = 0; i < 60; ++i) line.push_back({Eigen::Vector2d(4.0 * i, 50.0), Eigen::Vector2d(4.0 * i, 50.0)});
  EXPECT_NE(errorTextOf([&] { mapOf(line); }).find("on a line"), std::string::npos);
}

TEST(UndistortionMap, TheFileHoldsIt) {
  const TemporaryFolder folder;
  const UndistortionMap map = mapOf(marks(0.1));
  map.write(folder / "map.yaml");
  const UndistortionMap again = UndistortionMap::read(folder / "map.yaml");
  EXPECT_EQ(again.width(), 512);
  EXPECT_EQ(again.height(), 480);
  EXPECT_EQ(again.degree(), map.degree());
  for (int v = -20; v < 500; v += 13) {
    for (int u = -20; u < 530; u += 13) {
      const Eigen::Vector2d straight(u, v);
      EXPECT_LT((again.rawPixel(straight) - map.rawPixel(straight)).norm(), 1e-9);
      EXPECT_EQ(again.covers(straight), map.covers(straight));
    }
  }
}

/// The file with the first `from` replaced.
std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t place = text.find(from);
  EXPECT_NE(place, std::string::npos) << from;
  return text.replace(place, from.size(), to);
}

TEST(UndistortionMap, FilesThatAreNoneAreRefusedByName) {
  const TemporaryFolder folder;
  mapOf(marks(0.1)).write(folder / "map.yaml");
  std::ifstream stream(folder / "map.yaml");
  std::stringstream buffer;
  buffer << stream.rdbuf();
  const std::string good = buffer.str();
  const std::size_t hull = good.find("hull:");
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "no undistortion map"},
      {"words", "no undistortion map"},
      {"%YAML:1.0\n---\n- 1\n- 2\n", "no undistortion map"},
      {"%YAML:1.0\n---\nformat: something else\n", "no undistortion map"},
      {changed(good, "undistortion map 1", "undistortion map 2"), "no undistortion map"},
      {changed(good, "image_width: 512", "image_width: 0"), "'image_width' is 0"},
      {changed(good, "image_height: 480", "rows: 480"), "'image_height' is missing"},
      {changed(good, "degree: ", "degree: 9 #"), "'displacement_u' has"},
      {changed(good, "degree: ", "degree: 99 #"), "'degree' is 99"},
      {changed(good, "scale: ", "scale: -"), "'scale'"},
      {changed(good, "displacement_v: [", "displacement_v: [ .nan,"), "'displacement_v'"},
      {changed(good, "displacement_u: [", "displacement_u: [ word,"), "'displacement_u'"},
      {good.substr(0, hull) + "hull: [ 0., 0., 9., 0. ]\n", "'hull'"},
      {good.substr(0, hull) + "hull: [ 0., 0., 9., 0., 1., 1., 0., 9. ]\n", "'hull'"},
      {good.substr(0, hull), "'hull' is missing"},
  };
  for (const auto& [text, says] : cases) {
    test_files::writeBytes(folder / "bad.yaml", text);
    const std::string error = errorTextOf([&] { UndistortionMap::read(folder / "bad.yaml"); });
    EXPECT_NE(error.find(says), std::string::npos) << "expected: " << says << "\nsaid: " << error;
    EXPECT_NE(error.find("bad.yaml"), std::string::npos) << error;
  }
  EXPECT_NE(errorTextOf([&] { UndistortionMap::read(folder / "none.yaml"); }).find("no such file"), std::string::npos);
  EXPECT_NE(errorTextOf([&] { mapOf(marks()).write(folder / "none/map.yaml"); }).find("none/map.yaml"),
            std::string::npos);
}

}  // namespace
}  // namespace xray_registration
