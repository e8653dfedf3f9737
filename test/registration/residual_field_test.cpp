#include "registration/residual_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>

namespace xray_registration {
namespace {

constexpr int kTiles = 20;
constexpr double kMmPerPixel = 0.5;
/// Of a window's cost by its shift in pixels, alike along both axes.
constexpr double kCurvature = 50.0;

using Field = std::function<Eigen::Vector2d(double x, double y)>;

/// Windows all over one view whose cost is ½ · curvature · |shift − field|², and that a pose can shift as a whole: its
/// first two components move them by a millimetre, the others are known already.
SetupEvidence evidenceOf(const Field& field_mm) {
  const SetupLayout layout(1);
  SetupEvidence evidence(layout);
  evidence.mm_per_pixel = {kMmPerPixel};
  evidence.gradients = Eigen::MatrixXd::Zero(layout.size(), kTiles * kTiles);
  evidence.matrix.topLeftCorner<6, 6>().setIdentity();
  for (int y = 0; y < kTiles; ++y) {
    for (int x = 0; x < kTiles; ++x) {
      const auto w = static_cast<Eigen::Index>(evidence.windows.size());
      const Eigen::Vector2d gradient =
          -kCurvature / kMmPerPixel * field_mm((x + 0.5) / kTiles - 0.5, (y + 0.5) / kTiles - 0.5);
      SetupWindow window{0, x, y, 1.0, 0.9, 0.1};
      window.by_shift = kCurvature * Eigen::Matrix2d::Identity();
      window.pose_by_shift.topRows<2>() = kCurvature / kMmPerPixel * Eigen::Matrix2d::Identity();
      evidence.windows.push_back(window);
      evidence.gradients.block<2, 1>(layout.of(0, SetupLayout::kCentre), w) = gradient;
      evidence.gradients.block<2, 1>(0, w) = gradient / kMmPerPixel;
      evidence.matrix.topLeftCorner<2, 2>() += kCurvature / (kMmPerPixel * kMmPerPixel) * Eigen::Matrix2d::Identity();
    }
  }
  evidence.gradient = evidence.gradients.rowwise().sum();
  return evidence;
}

/// Shifts of ± 0.5 mm, each window for itself.
Field noise() {
  auto random = std::make_shared<std::mt19937>(5);
  return [random](double, double) {
    std::uniform_real_distribution<double> shift(-0.5, 0.5);
    return Eigen::Vector2d(shift(*random), shift(*random));
  };
}

TEST(ResidualFieldTest, AFieldThatNoPoseImitatesIsMeasured) {
  const Field bent = [](double x, double) { return Eigen::Vector2d(0.0, 0.8 * std::cos(2.0 * M_PI * (x + 0.5))); };
  const ResidualField motion = residualField(evidenceOf(bent));
  ASSERT_TRUE(motion.determined);
  // Of a wave's amplitude over √2; the ridge takes one hundredth of half of it.
  EXPECT_NEAR(motion.rms_mm, 0.8 / std::sqrt(2.0), 0.03);
  EXPECT_GT(motion.deviations, 6.0);
}

TEST(ResidualFieldTest, WhatThePoseCanFollowIsNoneOfIt) {
  const ResidualField motion = residualField(evidenceOf([](double, double) { return Eigen::Vector2d(1.0, -2.0); }));
  ASSERT_TRUE(motion.determined);
  EXPECT_LT(motion.rms_mm, 0.05);
}

TEST(ResidualFieldTest, NoiseOfTheWindowsIsNotCoherent) {
  const ResidualField motion = residualField(evidenceOf(noise()));
  ASSERT_TRUE(motion.determined);
  EXPECT_LT(std::abs(motion.deviations), 3.0);
  EXPECT_LT(motion.rms_mm, 0.1);  // Of 0.29 mm in each window.
}

TEST(ResidualFieldTest, ASmallFieldShowsInNoise) {
  const Field shifts = noise();
  const Field bent = [shifts](double x, double y) {
    return Eigen::Vector2d(shifts(x, y) + Eigen::Vector2d(0.3 * std::cos(2.0 * M_PI * (y + 0.5)), 0.0));
  };
  const ResidualField motion = residualField(evidenceOf(bent));
  EXPECT_GT(motion.deviations, 6.0);
  EXPECT_NEAR(motion.rms_mm, 0.3 / std::sqrt(2.0), 3.0 * motion.sigma_mm);
}

TEST(ResidualFieldTest, WithoutAPoseNothingIsSaid) {
  SetupEvidence evidence = evidenceOf(noise());
  evidence.matrix.topLeftCorner<6, 6>().setZero();
  EXPECT_FALSE(residualField(evidence).determined);
}

TEST(ResidualFieldTest, NumbersThatAreNotFiniteDetermineNothing) {
  SetupEvidence evidence = evidenceOf(noise());
  evidence.gradients(SetupLayout(1).of(0, SetupLayout::kCentre), 3) = std::nan("");
  EXPECT_FALSE(residualField(evidence).determined);
}

}  // namespace
}  // namespace xray_registration
