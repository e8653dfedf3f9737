#include "xray_registration/image/mask.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "xray_registration/image/metal_memory.h"

namespace xray_registration {
namespace {

/// A picture in millimetres of parallel beams: analytic chords of simple shapes, so that every edge is exact.
struct Scene {
  int size = 256;
  double mm_per_pixel = 0.8;
  double photons = 20000.0;
  double veil = 0.004;  ///< Scatter, share of the open beam.
  std::function<double(double, double)> line_integral = [](double, double) { return 0.0; };
  std::function<bool(double, double)> is_open = [](double, double) { return true; };  ///< Collimator, in pixels.

  /// Attenuation of the noisy picture; `truth` gets the centre of each pixel in mm.
  FloatImage attenuation(unsigned seed = 1) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    FloatImage image(size, size);
    for (int v = 0; v < size; ++v) {
      for (int u = 0; u < size; ++u) {
        const double primary = is_open(u, v) ? std::exp(-mean(u, v)) : 0.0;
        const double expected = photons * (primary + veil);
        const double counted = std::max(0.5, expected + std::sqrt(expected) * normal(random));
        image.at(u, v) = static_cast<float>(-std::log(counted / photons));
      }
    }
    return image;
  }

  double mm(double pixel) const { return (pixel - 0.5 * (size - 1)) * mm_per_pixel; }

 private:
  double mean(int u, int v) const {
    double transmitted = 0.0;
    for (const double du : {-0.25, 0.25})
      for (const double dv : {-0.25, 0.25}) transmitted += 0.25 * std::exp(-line_integral(mm(u + du), mm(v + dv)));
    return -std::log(transmitted);
  }
};

double ball(double x, double y, double cx, double cy, double radius) {
  return 2.0 * std::sqrt(std::max(0.0, radius * radius - (x - cx) * (x - cx) - (y - cy) * (y - cy)));
}

/// Chord of a cylinder in the picture's plane from (ax, ay) to (bx, by).
double rod(double x, double y, double ax, double ay, double bx, double by, double radius) {
  const double length = std::hypot(bx - ax, by - ay);
  const double along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length;
  if (along < 0.0 || along > length) return 0.0;
  const double across = ((x - ax) * (by - ay) - (y - ay) * (bx - ax)) / length;
  return 2.0 * std::sqrt(std::max(0.0, radius * radius - across * across));
}

constexpr double kWater = 0.02;
constexpr double kBone = 0.03;  ///< Above water.
constexpr double kSteel = 0.3;

/// A head: skin, skull 6 mm thick, a dense base, teeth.
double head(double x, double y) {
  double sum = kWater * ball(x, y, 0, 0, 80) + kBone * (ball(x, y, 0, 0, 75) - ball(x, y, 0, 0, 69));
  sum += 0.5 * kBone * ball(x, y, 5, 45, 18);
  for (const double tooth : {-40.0, -33.0, -26.0}) sum += 0.04 * rod(x, y, tooth, 40, tooth, 52, 3);
  return sum;
}

/// Dense trunk that reaches three borders, with two shafts (cortex 4 mm) and a ball joint.
double trunk(double x, double y) {
  double sum = kWater * 150.0 * (1.0 - 0.2 * std::pow(x / 100.0, 2));
  for (const double side : {-55.0, 55.0}) {
    sum += kBone * (rod(x, y, side, 20, 1.4 * side, 150, 14) - rod(x, y, side, 20, 1.4 * side, 150, 10));
    sum += 0.5 * kBone * ball(x, y, side, 10, 22);
  }
  return sum;
}

int kept(const MaskImage& mask) {
  return static_cast<int>(std::count_if(mask.pixels.begin(), mask.pixels.end(), [](std::uint8_t m) { return m != 0; }));
}

using Distance = std::function<double(double, double)>;  ///< In pixels, positive inside the field.

/// All that is well inside is kept, all that is well outside is left out.
void expectField(const MaskImage& mask, const Distance& inside, double margin, const std::string& what) {
  int lost = 0;
  int left = 0;
  for (int v = 0; v < mask.height; ++v) {
    for (int u = 0; u < mask.width; ++u) {
      const double distance = inside(u, v);
      lost += distance > margin && mask.at(u, v) == 0 ? 1 : 0;
      left += distance < -1.0 && mask.at(u, v) != 0 ? 1 : 0;
    }
  }
  EXPECT_EQ(lost, 0) << what << ": pixels of the field left out";
  // Where a straight edge meets the image's border, the last two pixels of a ray cannot be judged.
  EXPECT_LE(left, mask.width * mask.height / 1000) << what << ": pixels behind the collimator kept";
}

Distance disc(double cu, double cv, double radius) {
  return [=](double u, double v) { return radius - std::hypot(u - cu, v - cv); };
}

/// Inside of half-planes through points at `radii` from (cu, cv), turned by equal angles.
Distance polygon(double cu, double cv, const std::vector<double>& radii, double turn) {
  return [=](double u, double v) {
    double distance = 1e9;
    for (std::size_t i = 0; i < radii.size(); ++i) {
      const double angle = turn + 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(radii.size());
      distance = std::min(distance, radii[i] - (u - cu) * std::cos(angle) - (v - cv) * std::sin(angle));
    }
    return distance;
  };
}

Scene collimated(double (*anatomy)(double, double), const Distance& inside, int size = 256) {
  Scene scene;
  scene.size = size;
  scene.mm_per_pixel *= 256.0 / size;
  scene.line_integral = anatomy;
  scene.is_open = [inside](double u, double v) { return inside(u, v) >= 0.0; };
  return scene;
}

/// What the search may lose inside: the contour is found to a pixel and drawn one further in.
constexpr double kMargin = 4.0;

TEST(FieldMask, NothingIsMaskedWithoutACollimator) {
  Scene scene;
  const auto limb = [](double x, double y) {  // Air in the middle, a thigh that leaves on the left.
    return kWater * rod(x, y, -100, -200, -90, 200, 60) + kBone * rod(x, y, -100, -200, -90, 200, 15);
  };
  for (const auto& anatomy : {std::function<double(double, double)>(head), std::function<double(double, double)>(trunk),
                              std::function<double(double, double)>(limb)}) {
    scene.line_integral = anatomy;
    for (const double photons : {300.0, 20000.0}) {
      scene.photons = photons;
      EXPECT_EQ(kept(fieldMask(scene.attenuation())), 256 * 256) << photons << " photons";
    }
  }
  scene.line_integral = [](double, double) { return 0.0; };
  EXPECT_EQ(kept(fieldMask(scene.attenuation())), 256 * 256) << "open beam";
}

TEST(FieldMask, RoundCollimators) {
  for (const auto anatomy : {head, trunk}) {
    for (const Distance& inside : {disc(127.5, 127.5, 90), disc(120, 140, 100), disc(127.5, 127.5, 150)}) {
      expectField(fieldMask(collimated(anatomy, inside).attenuation()), inside, kMargin, "round");
    }
  }
}

TEST(FieldMask, PolygonsAndShutters) {
  const Distance hexagon = polygon(127.5, 127.5, {90, 90, 90, 90, 90, 90}, 0.2);
  const Distance rectangle = polygon(127.5, 127.5, {100, 70, 60, 110}, 0.1);
  const Distance left_shutter = [](double u, double) { return u - 70.3; };
  const Distance two_shutters = [](double, double v) { return std::min(v - 50.2, 200.7 - v); };
  for (const auto anatomy : {head, trunk}) {
    expectField(fieldMask(collimated(anatomy, hexagon).attenuation()), hexagon, kMargin, "hexagon");
    expectField(fieldMask(collimated(anatomy, rectangle).attenuation()), rectangle, kMargin + 2, "rectangle");
    expectField(fieldMask(collimated(anatomy, left_shutter).attenuation()), left_shutter, kMargin, "left shutter");
    expectField(fieldMask(collimated(anatomy, two_shutters).attenuation()), two_shutters, kMargin, "two shutters");
  }
}

TEST(FieldMask, SmallFieldInACorner) {
  const Distance inside = disc(70, 180, 50);
  expectField(fieldMask(collimated(trunk, inside).attenuation()), inside, kMargin, "corner");
}

TEST(FieldMask, LargeImagesAreSearchedSmall) {
  const Distance inside = disc(500, 520, 400);
  // One pixel of the searched copy is four of this image.
  expectField(fieldMask(collimated(head, inside, 1024).attenuation()), inside, 4 * kMargin, "1024");
}

TEST(FieldMask, LettersOnTheShutterDoNotOpenIt) {
  const Distance inside = disc(127.5, 127.5, 90);
  FloatImage image = collimated(trunk, inside).attenuation();
  for (int v = 8; v < 16; ++v)
    for (int u = 10; u < 40; u += 5) image.at(u, v) = image.at(u + 1, v) = 0.0F;  // White strokes.
  const MaskImage mask = fieldMask(image);
  expectField(mask, inside, kMargin, "letters");
}

TEST(FieldMask, ThinFrames) {
  Scene scene;
  scene.line_integral = trunk;
  FloatImage dark = scene.attenuation();
  FloatImage white = dark;
  for (int v = 0; v < 256; ++v) {
    for (int u = 0; u < 256; ++u) {
      if (v < 3) dark.at(u, v) = 9.0F;
      if (u >= 254) dark.at(u, v) = 9.0F;
      if (u < 2) white.at(u, v) = 0.0F;
    }
  }
  const Distance in_dark = [](double u, double v) { return std::min(v - 2.5, 253.5 - u); };
  const Distance in_white = [](double u, double) { return u - 1.5; };
  expectField(fieldMask(dark), in_dark, kMargin, "dark frame");
  expectField(fieldMask(white), in_white, kMargin, "white frame");
}

/// A picture around which a device has drawn something: of this value (nepers), a little unsteady as in a video.
FloatImage surrounded(const std::function<double(double, double)>& anatomy, const Distance& inside, float value,
                      float unsteady = 0.0F) {
  Scene scene;
  scene.photons = 4000.0;
  scene.line_integral = anatomy;
  FloatImage image = scene.attenuation();
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  for (int v = 0; v < image.height; ++v)
    for (int u = 0; u < image.width; ++u)
      if (inside(u, v) < 0.0) image.at(u, v) = value - unsteady * std::abs(normal(random));
  return image;
}

// Brighter than the beam, as black around a video whose bones are white, and darker.
TEST(FieldMask, WhatADeviceDrawsAroundItsPicture) {
  const std::vector<std::pair<std::string, Distance>> shapes = {
      {"disc", disc(127.5, 127.5, 110)},
      {"disc off the middle", disc(105, 150, 95)},
      {"disc that is cut", disc(127.5, 127.5, 150)},
      {"rectangle", polygon(127.5, 127.5, {100, 80, 90, 85}, 0.0)},
      {"turned rectangle", polygon(127.5, 127.5, {100, 80, 90, 85}, 0.35)},
      {"octagon", polygon(127.5, 127.5, std::vector<double>(8, 105), M_PI / 8)},
      {"bars above and below", [](double, double v) { return std::min(v - 35.5, 220.5 - v); }},
      {"bars at the sides", [](double u, double) { return std::min(u - 45.5, 210.5 - u); }},
      {"one side", [](double u, double) { return 200.5 - u; }}};
  for (const auto& [name, inside] : shapes) {
    for (const auto anatomy : {head, trunk}) {
      for (const float value : {-0.2F, 7.0F}) {
        expectField(fieldMask(surrounded(anatomy, inside, value)), inside, kMargin + 2, name);
      }
    }
    expectField(fieldMask(surrounded(trunk, inside, -0.2F, 0.004F)), inside, kMargin + 2, name + ", unsteady");
  }
}

// Where air in the field is as bright as what is drawn, arcs of the circle are still seen.
TEST(FieldMask, ADiscWithSaturatedAirInIt) {
  const Distance inside = disc(127.5, 127.5, 100);
  const float saturated = 0.05F;
  const auto shoulder = [](double x, double y) { return trunk(x, y) * std::clamp((x + y + 90.0) / 60.0, 0.0, 1.0); };
  FloatImage image = surrounded(shoulder, inside, saturated);
  for (float& value : image.pixels) value = std::max(value, saturated);
  expectField(fieldMask(image), inside, kMargin, "disc");
}

TEST(FieldMask, AirIsNoSurround) {
  // Air beside what is dense is still, as its light is strong: it is not drawn.
  const auto slab = [](double x, double y) { return std::abs(x) < 75 && std::abs(y) < 60 ? 4.0 : 0.0; };
  const auto box = [](double x, double y) { return std::abs(x) < 50 && std::abs(y) < 40 ? 1.6 : 0.0; };
  for (const auto& anatomy : {std::function<double(double, double)>(head), std::function<double(double, double)>(slab),
                              std::function<double(double, double)>(box)}) {
    for (const double photons : {300.0, 20000.0, 1e14}) {  // The last as without noise.
      for (const float saturation : {-1.0F, 0.05F, 0.3F}) {
        Scene scene;
        scene.photons = photons;
        scene.line_integral = anatomy;
        FloatImage image = scene.attenuation();
        for (float& value : image.pixels) value = std::max(value, saturation);
        // Air that saturates around a large block with straight sides cannot be told from a surround.
        if (saturation > 0.0F && anatomy(74.0, 0.0) == 4.0) continue;
        EXPECT_EQ(kept(fieldMask(image)), 256 * 256) << photons << " photons, saturated at " << saturation;
      }
    }
  }
}

TEST(FieldMask, TinyAndConstantImagesAreKept) {
  EXPECT_EQ(kept(fieldMask(FloatImage(5, 3, 1.0F))), 15);
  EXPECT_EQ(kept(fieldMask(FloatImage(100, 100, 1.0F))), 10000);
}

/// The metal's shadow is left out, and hardly more than its rim.
void expectMetal(const Scene& scene, const std::function<double(double, double)>& steel, const std::string& what) {
  const MaskImage mask = metalMask(scene.attenuation(), {});
  const int rim = 4;  // Two pixels of blur, one of the outline, one of the rounding of the corner of a square.
  int missed = 0;
  int shadow = 0;
  int anatomy = 0;
  for (int v = 0; v < mask.height; ++v) {
    for (int u = 0; u < mask.width; ++u) {
      const bool in_shadow = steel(scene.mm(u), scene.mm(v)) > 1.0;
      shadow += in_shadow ? 1 : 0;
      missed += in_shadow && mask.at(u, v) != 0 ? 1 : 0;
      if (mask.at(u, v) != 0) continue;
      bool near_metal = false;
      for (int dv = -rim; dv <= rim && !near_metal; ++dv)
        for (int du = -rim; du <= rim && !near_metal; ++du)
          near_metal = steel(scene.mm(u + du), scene.mm(v + dv)) > 0.0;
      anatomy += near_metal ? 0 : 1;
    }
  }
  EXPECT_GT(shadow, 0) << what;
  // Where a rod crosses the skull's limb a few pixels of it look like bone; where such a gap is bridged, or a rod ends
  // in a corner, a few pixels beside it are lost. Robust weights bear both.
  EXPECT_LE(missed, shadow / 50) << what << ": of " << shadow << " pixels of metal";
  EXPECT_LE(anatomy, 10) << what << ": pixels of anatomy masked";
}

TEST(MetalMask, RodsBallsAndScrewsAreFoundAndNothingElse) {
  const auto instrument = [](double x, double y) {
    return std::max(rod(x, y, -60, -80, -5, 20, 2.0), ball(x, y, 40, -30, 8));
  };
  const auto across_bone = [](double x, double y) { return rod(x, y, 20, 10, 98, 26, 2.5); };
  const auto leaving = [](double x, double y) { return rod(x, y, 0, -20, 30, -300, 2.0); };
  for (const auto anatomy : {head, trunk}) {
    for (const auto& steel :
         {std::function<double(double, double)>(instrument), std::function<double(double, double)>(across_bone),
          std::function<double(double, double)>(leaving)}) {
      Scene scene;
      scene.line_integral = [&](double x, double y) { return anatomy(x, y) + kSteel * steel(x, y); };
      expectMetal(scene, steel, anatomy == head ? "head" : "trunk");
    }
  }
}

TEST(MetalMask, BeadsOfAFewPixels) {
  const auto beads = [](double x, double y) {
    double sum = 0.0;
    for (const double cx : {-40.0, -10.0, 20.0})
      for (const double cy : {-45.0, -25.0}) sum += ball(x, y, cx, cy, 1.2);
    return sum;
  };
  Scene scene;
  scene.line_integral = [&](double x, double y) { return head(x, y) + kSteel * beads(x, y); };
  expectMetal(scene, beads, "beads");
}

TEST(MetalMask, LargeImage) {
  const auto steel = [](double x, double y) { return rod(x, y, -60, -80, 5, 60, 2.5); };
  Scene scene;
  scene.size = 700;  // Searched at half of its size.
  scene.mm_per_pixel = 0.3;
  scene.line_integral = [&](double x, double y) { return head(x, y) + kSteel * steel(x, y); };
  const MaskImage mask = metalMask(scene.attenuation(), {});
  int missed = 0;
  for (int v = 0; v < 700; ++v)
    for (int u = 0; u < 700; ++u) missed += mask.at(u, v) != 0 && steel(scene.mm(u), scene.mm(v)) > 1.0 ? 1 : 0;
  EXPECT_EQ(missed, 0);
  // The rod's shadow is 514 × 17 pixels; a rim of two pixels and the outline's pixel on a copy of a quarter of the size
  // make it 12 wider on every side.
  EXPECT_LT(700 * 700 - kept(mask), (514 + 24) * (17 + 24));
}

TEST(MetalMask, BonesStayAtAnyNoise) {
  for (const auto anatomy : {head, trunk}) {
    for (const double photons : {100.0, 1000.0, 20000.0, 1e6}) {
      Scene scene;
      scene.photons = photons;
      scene.line_integral = anatomy;
      const FloatImage image = scene.attenuation();
      EXPECT_EQ(kept(metalMask(image, {})), 256 * 256) << photons << " photons";
    }
  }
}

/// Frame `number` of a weak beam in which a trunk moves behind a rod that stays.
FloatImage rodBeforeATrunk(int number, bool with_rod) {
  Scene scene;
  scene.photons = 4000.0;
  scene.line_integral = [=](double x, double y) {
    const double steel = with_rod ? rod(x, y, -60, -50, 70, 40, 2.5) : 0.0;
    return trunk(x - 1.5 * number, y) + 0.5 * kSteel * steel;
  };
  return scene.attenuation(static_cast<unsigned>(number) + 1);
}

double shareOfRod(const MaskImage& mask) {
  const Scene scene;
  int shadow = 0;
  int masked = 0;
  for (int v = 0; v < 256; ++v) {
    for (int u = 0; u < 256; ++u) {
      if (rod(scene.mm(u), scene.mm(v), -60, -50, 70, 40, 2.5) <= 1.0) continue;
      ++shadow;
      masked += mask.at(u, v) == 0 ? 1 : 0;
    }
  }
  return static_cast<double>(masked) / shadow;
}

TEST(MetalMemory, MakesMetalSteadyOverASequence) {
  MaskOptions metal_only;
  metal_only.collimator = metal_only.letters = false;
  MetalMemory memory;
  bool found_before = false;
  int missed_alone = 0;
  for (int number = 0; number < 10; ++number) {
    XrayFrame alone;
    alone.attenuation = rodBeforeATrunk(number, true);
    XrayFrame frame = alone;
    maskFrame(&alone, metal_only, {});
    maskFrame(&frame, metal_only, {}, &memory);
    const double share = shareOfRod(frame.mask);
    // Most of it, ends and crossings left out.
    if (found_before) {
      EXPECT_GT(share, 0.8) << "frame " << number;
      missed_alone += shareOfRod(alone.mask) < 0.1 ? 1 : 0;
    }
    found_before = found_before || share > 0.8;
  }
  EXPECT_TRUE(found_before);
  EXPECT_GT(missed_alone, 0) << "the scene is too easy to show anything";
}

TEST(MetalMemory, LetsGoWhenTheRodIsGone) {
  MaskOptions metal_only;
  metal_only.collimator = metal_only.letters = false;
  MetalMemory memory;
  XrayFrame frame;
  frame.attenuation = rodBeforeATrunk(9, true);
  maskFrame(&frame, metal_only, {}, &memory);
  ASSERT_GT(shareOfRod(frame.mask), 0.8);
  frame = XrayFrame();
  frame.attenuation = rodBeforeATrunk(9, false);
  maskFrame(&frame, metal_only, {}, &memory);
  EXPECT_EQ(kept(frame.mask), 256 * 256);
  // Another size begins anew.
  frame = XrayFrame();
  frame.attenuation = FloatImage(100, 80, 1.0F);
  maskFrame(&frame, metal_only, {}, &memory);
  EXPECT_EQ(kept(frame.mask), 8000);
}

TEST(MetalMask, TheFieldsEdgeIsNoMetal) {
  const Distance inside = disc(127.5, 127.5, 90);
  for (const auto anatomy : {head, trunk}) {
    const FloatImage image = collimated(anatomy, inside).attenuation();
    const MaskImage field = fieldMask(image);
    const MaskImage mask = metalMask(image, field);
    int lost = 0;
    for (std::size_t i = 0; i < field.pixels.size(); ++i) lost += field.pixels[i] != 0 && mask.pixels[i] == 0 ? 1 : 0;
    EXPECT_EQ(lost, 0);
  }
}

/// Draws an "H" and an "L" with strokes of three pixels; returns their pixels.
MaskImage drawLetters(FloatImage* image, int left, int top, float value) {
  MaskImage drawn(image->width, image->height, 0);
  for (int v = 0; v < 18; ++v) {
    for (int u = 0; u < 26; ++u) {
      const bool in_h = u < 3 || (u >= 9 && u < 12) || (u < 12 && v >= 8 && v < 11);
      const bool in_l = (u >= 16 && u < 19) || (u >= 16 && v >= 15);
      if (!in_h && !in_l) continue;
      image->at(left + u, top + v) = value;
      drawn.at(left + u, top + v) = 255;
    }
  }
  return drawn;
}

TEST(LetterMask, WhiteAndBlackLettersAreFound) {
  for (const float share : {0.0F, 1.0F}) {
    Scene scene;
    scene.line_integral = share == 0.0F ? trunk : head;
    FloatImage image = scene.attenuation();
    const auto [low, high] = std::minmax_element(image.pixels.begin(), image.pixels.end());
    // As burned in: the display's white or black, which the picture itself does not pass.
    const float value = share == 0.0F ? *low - 1.0F : *high + 0.5F;
    const MaskImage drawn = drawLetters(&image, 8, 8, value);
    const MaskImage mask = letterMask(image, {});
    int missed = 0;
    int masked = 0;
    for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
      missed += drawn.pixels[i] != 0 && mask.pixels[i] != 0 ? 1 : 0;
      masked += mask.pixels[i] == 0 ? 1 : 0;
    }
    EXPECT_EQ(missed, 0);
    // Letters and a rim of two pixels lie in a box of 30 × 22.
    EXPECT_LE(masked, 30 * 22);
  }
}

TEST(LetterMask, AnatomyAndSaturatedBackgroundStay) {
  for (const auto anatomy : {head, trunk}) {
    Scene scene;
    scene.line_integral = anatomy;
    FloatImage image = scene.attenuation();
    EXPECT_EQ(kept(letterMask(image, {})), 256 * 256);
    for (float& value : image.pixels) value = std::max(value, 0.05F);  // Saturated.
    EXPECT_EQ(kept(letterMask(image, {})), 256 * 256);
  }
  EXPECT_EQ(kept(letterMask(FloatImage(64, 64, 2.0F), {})), 64 * 64);
}

XrayFrame frameOf(const FloatImage& attenuation) {
  XrayFrame frame;
  frame.camera = {attenuation.width, attenuation.height, 1000.0, 1000.0, 127.5, 127.5};
  frame.attenuation = attenuation;
  frame.mask = MaskImage(attenuation.width, attenuation.height, 255);
  return frame;
}

/// Counts of a detector behind what attenuates, and the same numbers as floats.
struct CountsAndFloats {
  AttenuationImage counts;
  AttenuationImage floats;
};

CountsAndFloats countedBehind(const FloatImage& attenuation) {
  CountImage counts(attenuation.width, attenuation.height);
  for (std::size_t i = 0; i < counts.pixels.size(); ++i) {
    counts.pixels[i] = static_cast<std::uint16_t>(std::clamp(40000.0F * std::exp(-attenuation.pixels[i]), 1.0F, 6e4F));
  }
  std::vector<float> worth(60001);
  for (std::size_t i = 0; i < worth.size(); ++i) {
    worth[i] = -std::log(std::max(static_cast<float>(i), 0.5F) / 40000.0F);
  }
  AttenuationImage of_counts(counts, worth);
  FloatImage values = of_counts.values();
  return {std::move(of_counts), std::move(values)};
}

TEST(MaskFrame, CountsAreMaskedAsTheirValuesAre) {
  const Distance inside = disc(127.5, 127.5, 110);
  Scene scene = collimated(head, inside);
  scene.line_integral = [&](double x, double y) { return head(x, y) + kSteel * ball(x, y, 30, -40, 6); };
  FloatImage attenuation = scene.attenuation();
  drawLetters(&attenuation, 90, 60, 9.0F);
  // A small image, and one whose copies have no common factor (3 and 7).
  for (const int factor : {1, 7}) {
    FloatImage large(256 * factor, 250 * factor);
    for (int v = 0; v < large.height; ++v) {
      for (int u = 0; u < large.width; ++u) large.at(u, v) = attenuation.at(u / factor, v / factor);
    }
    const CountsAndFloats both = countedBehind(large);
    XrayFrame of_counts = frameOf(large);
    of_counts.attenuation = both.counts;
    XrayFrame of_floats = of_counts;
    of_floats.attenuation = both.floats;
    maskFrame(&of_counts, {}, {});
    maskFrame(&of_floats, {}, {});
    EXPECT_EQ(of_counts.mask.pixels, of_floats.mask.pixels);
    const auto masked = std::count(of_counts.mask.pixels.begin(), of_counts.mask.pixels.end(), 0);
    EXPECT_GT(masked, large.width * large.height / 10) << "the collimator at least";
  }
  const CountsAndFloats both = countedBehind(attenuation);
  const MaskImage letters = letterMask(both.counts, {});
  EXPECT_EQ(letters.pixels, letterMask(both.floats, {}).pixels);
  EXPECT_LT(kept(letters), 256 * 256) << "letters";
}

TEST(MaskFrame, JoinsWhatIsAskedForAndKeepsWhatWasMasked) {
  const Distance inside = disc(127.5, 127.5, 110);
  const auto steel = [](double x, double y) { return ball(x, y, 30, -40, 6); };
  Scene scene = collimated(head, inside);
  scene.line_integral = [&](double x, double y) { return head(x, y) + kSteel * steel(x, y); };
  const FloatImage image = scene.attenuation();
  const int ball_u = 127 + 38;
  const int ball_v = 127 - 50;

  MaskImage user(256, 256, 1);
  user.at(100, 100) = 0;
  XrayFrame frame = frameOf(image);
  frame.mask.at(120, 120) = 0;
  maskFrame(&frame, {}, user);
  EXPECT_EQ(frame.mask.at(2, 2), 0) << "collimator";
  EXPECT_EQ(frame.mask.at(ball_u, ball_v), 0) << "metal";
  EXPECT_EQ(frame.mask.at(100, 100), 0) << "user's mask";
  EXPECT_EQ(frame.mask.at(120, 120), 0) << "masked before";
  EXPECT_NE(frame.mask.at(110, 140), 0) << "anatomy";

  MaskOptions nothing;
  nothing.collimator = nothing.letters = nothing.metal = false;
  frame = frameOf(image);
  maskFrame(&frame, nothing, {});
  EXPECT_EQ(kept(frame.mask), 256 * 256);
  EXPECT_THROW(maskFrame(&frame, nothing, MaskImage(255, 256, 1)), FrameError);
}

}  // namespace
}  // namespace xray_registration
