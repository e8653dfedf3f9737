#include "xray_registration/evaluation/xray_simulator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "xray_registration/drr/reference_projector.h"

namespace xray_registration {
namespace {

XrayCamera camera() { return {96, 80, 700.0, 700.0, 47.5, 39.5}; }

XrayPhysics cleanPhysics() {
  XrayPhysics physics;
  physics.photons_per_pixel = 0.0;
  physics.readout_noise = 0.0;
  physics.scatter_fraction = 0.0;
  physics.gain = 1.0;
  return physics;
}

AttenuationVolume box() {
  AttenuationVolume volume;
  volume.grid.size = {20, 20, 20};
  volume.grid.spacing_mm = {2.0, 2.0, 2.0};
  volume.grid.origin_ct_mm = {-19.0, -19.0, 400.0};
  volume.values.assign(volume.grid.voxelCount(), 1000);
  volume.scale_per_mm = 2e-5F;
  return volume;
}

Image<std::uint16_t> simulate(const AttenuationVolume& volume, const XrayPhysics& physics, unsigned seed = 1) {
  std::mt19937_64 random(seed);
  return simulateXray(volume, RigidTransform::Identity(), camera(), physics, &random);
}

double mean(const Image<std::uint16_t>& image) {
  double sum = 0.0;
  for (const std::uint16_t value : image.pixels) sum += value;
  return sum / static_cast<double>(image.pixels.size());
}

double variance(const Image<std::uint16_t>& image) {
  const double centre = mean(image);
  double sum = 0.0;
  for (const std::uint16_t value : image.pixels) sum += (value - centre) * (value - centre);
  return sum / static_cast<double>(image.pixels.size() - 1);
}

TEST(XraySimulator, WithoutNoiseItIsBeerLambert) {
  const Image<std::uint16_t> image = simulate(box(), cleanPhysics());
  double darkest = 1e9;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const double integral = referenceLineIntegral(box(), RigidTransform::Identity(), camera(), u, v);
      // 20000 photons without noise; rounding to counts is half a count, floats along the way less than 0.01.
      ASSERT_NEAR(image.at(u, v), 20000.0 * std::exp(-integral), 0.51) << u << ", " << v;
      darkest = std::min<double>(darkest, image.at(u, v));
    }
  }
  EXPECT_LT(darkest, 0.5 * 20000.0) << "the box must be in the image for this test to mean anything";
}

TEST(XraySimulator, NoiseHasTheMeanAndVarianceOfPhotonsAndReadout) {
  XrayPhysics physics;
  physics.scatter_fraction = 0.0;
  physics.photons_per_pixel = 900.0;
  physics.gain = 3.0;
  physics.readout_noise = 40.0;
  const Image<std::uint16_t> image = simulate({}, physics);
  const double n = static_cast<double>(image.pixels.size());
  // Poisson counts times the gain, readout, and rounding to integers.
  const double expected_variance = 9.0 * 900.0 + 40.0 * 40.0 + 1.0 / 12.0;
  // Four standard errors each: a right simulator fails once in 16000 seeds, and the seed is fixed.
  EXPECT_NEAR(mean(image), 2700.0, 4.0 * std::sqrt(expected_variance / n));
  EXPECT_NEAR(variance(image), expected_variance, 4.0 * expected_variance * std::sqrt(2.0 / n));
}

TEST(XraySimulator, SameSeedSameImageOtherSeedOtherImage) {
  const Image<std::uint16_t> first = simulate(box(), XrayPhysics{}, 7);
  EXPECT_EQ(first.pixels, simulate(box(), XrayPhysics{}, 7).pixels);
  EXPECT_NE(first.pixels, simulate(box(), XrayPhysics{}, 8).pixels);
}

TEST(XraySimulator, ScatterAddsItsFractionOfThePrimaryEverywhere) {
  XrayPhysics physics = cleanPhysics();
  const double primary = mean(simulate(box(), physics));
  physics.scatter_fraction = 0.5;
  physics.scatter_sigma_px = 20.0;
  const Image<std::uint16_t> image = simulate(box(), physics);
  // The veil keeps the sum of what it blurs; the rest is rounding of 7680 pixels to counts.
  EXPECT_NEAR(mean(image), 1.5 * primary, 0.05);
  // Behind the box more than half of the primary is missing; the veil brings light there from beside it.
  const double alone = 20000.0 * std::exp(-referenceLineIntegral(box(), RigidTransform::Identity(), camera(), 47, 39));
  EXPECT_GT(image.at(47, 39), 1.55 * alone);
}

TEST(XraySimulator, SaturationAndZeroAreLimits) {
  XrayPhysics physics;
  physics.saturation = 30000.0;
  physics.gain = 4.0;
  const Image<std::uint16_t> bright = simulate({}, physics);
  EXPECT_EQ(*std::max_element(bright.pixels.begin(), bright.pixels.end()), 30000);
  physics.saturation = 1e6;  // More than 16 bits hold.
  EXPECT_EQ(simulate({}, physics).at(0, 0), 65535);
  physics.photons_per_pixel = 1.0;
  physics.readout_noise = 100.0;
  const Image<std::uint16_t> dark = simulate({}, physics);
  EXPECT_EQ(*std::min_element(dark.pixels.begin(), dark.pixels.end()), 0);
}

TEST(XraySimulator, CollimatorIsRound) {
  XrayPhysics physics = cleanPhysics();
  physics.collimator_radius_px = 30.0;
  const Image<std::uint16_t> image = simulate({}, physics);
  EXPECT_EQ(image.at(48, 40), 20000);
  EXPECT_EQ(image.at(48 + 28, 40), 20000);
  EXPECT_EQ(image.at(48 + 32, 40), 0);
  EXPECT_EQ(image.at(0, 0), 0);
}

TEST(XraySimulator, PixelsAverageIntensities) {
  // A ball smaller than a pixel: the pixel sees a part of its shadow.
  XrayPhysics physics = cleanPhysics();
  physics.instruments.push_back({{0.0, 0.0, 700.0}, {0.0, 0.0, 700.0}, 0.4, 1000.0});
  physics.samples_per_pixel_axis = 16;
  const Image<std::uint16_t> image = simulate({}, physics);
  double missing = 0.0;
  for (const std::uint16_t value : image.pixels) missing += 1.0 - value / 20000.0;
  // At 700 mm a pixel is 1 mm: an opaque disc of 0.4 mm radius hides π 0.4² pixels. 16 samples an axis over four
  // pixels place its rim within 1/16 pixel: 5 % of the area.
  EXPECT_NEAR(missing, M_PI * 0.16, 0.05 * M_PI * 0.16);
}

TEST(InstrumentChord, BallThroughCentreOffCentreAndMissed) {
  const Instrument ball{{0.0, 0.0, 500.0}, {0.0, 0.0, 500.0}, 10.0, 0.3};
  EXPECT_NEAR(instrumentChordMm(ball, {0, 0, 1}), 20.0, 1e-9);
  EXPECT_NEAR(instrumentChordMm(ball, {0, 0, 42}), 20.0, 1e-9) << "the direction's length must not count";
  const double angle = std::asin(6.0 / 500.0);  // Passes the centre at 6 mm: half chord 8 mm.
  EXPECT_NEAR(instrumentChordMm(ball, {std::sin(angle), 0, std::cos(angle)}), 16.0, 1e-9);
  EXPECT_EQ(instrumentChordMm(ball, {0.03, 0, 1}), 0.0);
  EXPECT_EQ(instrumentChordMm(ball, {0, 0, -1}), 0.0) << "behind the source";
}

TEST(InstrumentChord, RodAcrossObliqueAlongAndPastItsEnd) {
  const Instrument across{{-50.0, 0.0, 500.0}, {50.0, 0.0, 500.0}, 2.0, 0.3};
  EXPECT_NEAR(instrumentChordMm(across, {0, 0, 1}), 4.0, 1e-9);
  // 45° between rod and ray: the chord grows by √2.
  const Instrument oblique{{0.0, -50.0, 450.0}, {0.0, 50.0, 550.0}, 2.0, 0.3};
  EXPECT_NEAR(instrumentChordMm(oblique, {0, 0, 1}), 4.0 * std::sqrt(2.0), 1e-9);
  const Instrument along{{0.0, 0.0, 500.0}, {0.0, 0.0, 560.0}, 2.0, 0.3};
  EXPECT_NEAR(instrumentChordMm(along, {0, 0, 1}), 64.0, 1e-9);
  // 1 mm past the end b the ray meets the ball there and no more of the rod.
  const Instrument end_ball{across.b_camera_mm, across.b_camera_mm, 2.0, 0.3};
  const Eigen::Vector3d past_end(51.0, 0.0, 500.0);
  EXPECT_GT(instrumentChordMm(across, past_end), 3.0);
  EXPECT_NEAR(instrumentChordMm(across, past_end), instrumentChordMm(end_ball, past_end), 1e-9);
  EXPECT_EQ(instrumentChordMm(across, {53.0, 0.0, 500.0}), 0.0);
}

TEST(InstrumentChord, AgreesWithCountingSteps) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int hits = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const auto point = [&] {
      return Eigen::Vector3d(20 * uniform(random), 20 * uniform(random), 60 + 20 * uniform(random));
    };
    const Instrument capsule{point(), point(), 6.0, 0.3};
    const Eigen::Vector3d direction = point().normalized();
    const Eigen::Vector3d span = capsule.b_camera_mm - capsule.a_camera_mm;
    int inside = 0;
    constexpr double kStep = 0.01;
    for (double at = 0.5 * kStep; at < 150.0; at += kStep) {
      const Eigen::Vector3d offset = at * direction - capsule.a_camera_mm;
      const double along = std::clamp(offset.dot(span) / span.squaredNorm(), 0.0, 1.0);
      if ((offset - along * span).squaredNorm() < 36.0) ++inside;
    }
    hits += inside > 0 ? 1 : 0;
    // Counting places each end within a step.
    ASSERT_NEAR(instrumentChordMm(capsule, direction), inside * kStep, 2 * kStep) << "trial " << trial;
  }
  EXPECT_GT(hits, 40);
}

TEST(XraySimulator, RefusesWhatIsNotPhysics) {
  XrayPhysics physics;
  physics.gain = 0.0;
  EXPECT_THROW(simulate({}, physics), std::invalid_argument);
  physics = XrayPhysics{};
  physics.photons_per_pixel = -1.0;
  EXPECT_THROW(simulate({}, physics), std::invalid_argument);
  physics = XrayPhysics{};
  physics.readout_noise = std::nan("");
  EXPECT_THROW(simulate({}, physics), std::invalid_argument);
}

TEST(XraySimulator, PartsAddUp) {
  // A box in two halves at one place is the box; a half that is moved darkens where it went.
  AttenuationVolume half = box();
  for (std::uint16_t& value : half.values) value /= 2;
  const RigidTransform place = RigidTransform::Identity();
  std::mt19937_64 random(1);
  const Image<std::uint16_t> whole = simulate(box(), cleanPhysics());
  const Image<std::uint16_t> parts = simulateXray({{&half, place}, {&half, place}}, camera(), cleanPhysics(), &random);
  for (std::size_t i = 0; i < whole.pixels.size(); ++i) ASSERT_NEAR(parts.pixels[i], whole.pixels[i], 1);
  RigidTransform moved = place;
  moved.translation().x() = 15.0;
  const Image<std::uint16_t> apart = simulateXray({{&half, place}, {&half, moved}}, camera(), cleanPhysics(), &random);
  const int v = 40;
  for (int u = 0; u < apart.width; ++u) {
    const double integral =
        referenceLineIntegral(half, place, camera(), u, v) + referenceLineIntegral(half, moved, camera(), u, v);
    ASSERT_NEAR(apart.at(u, v), 20000.0 * std::exp(-integral), 0.51) << u;
  }
}

}  // namespace
}  // namespace xray_registration
