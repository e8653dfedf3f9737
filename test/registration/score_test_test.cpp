#include "registration/score_test.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

namespace xray_registration {
namespace {

constexpr int kWindows = 400;

/// Linear least squares as evidence: windows of residuals r = A x − b with x over one view's layout.
class LinearFrame {
 public:
  explicit LinearFrame(unsigned seed) : bits_(seed), layout_(1), design_(kWindows, layout_.size()) {
    for (Eigen::Index i = 0; i < design_.size(); ++i) design_.data()[i] = normal_(bits_);
  }

  Eigen::MatrixXd& design() { return design_; }

  /// The evidence at zero when the truth is x and residuals have noise.
  SetupEvidence at(const Eigen::VectorXd& truth, double noise) {
    SetupEvidence evidence(layout_);
    evidence.gradients.resize(layout_.size(), kWindows);
    for (int i = 0; i < kWindows; ++i) {
      const double residual = -design_.row(i).dot(truth) + noise * normal_(bits_);
      evidence.gradients.col(i) = design_.row(i).transpose() * residual;
      evidence.cost += 0.5 * residual * residual;
    }
    evidence.gradient = evidence.gradients.rowwise().sum();
    evidence.matrix = design_.transpose() * design_;
    return evidence;
  }

  Eigen::VectorXd nothing() const { return Eigen::VectorXd::Zero(layout_.size()); }
  Eigen::MatrixXd basis(int parameter, int count) const {
    Eigen::MatrixXd chosen = Eigen::MatrixXd::Zero(layout_.size(), count);
    for (int i = 0; i < count; ++i) chosen(layout_.of(0, parameter) + i, i) = 1.0;
    return chosen;
  }
  int focal() const { return layout_.of(0, SetupLayout::kFocal); }

 private:
  std::mt19937 bits_;
  std::normal_distribution<double> normal_;
  SetupLayout layout_;
  Eigen::MatrixXd design_;
};

TEST(ScoreTest, FindsAParameterWhateverThePoseIs) {
  LinearFrame frame(1);
  Eigen::VectorXd truth = frame.nothing();
  truth.head<6>() << 1.0, -2.0, 3.0, 0.5, 0.4, -0.3;
  truth[frame.focal()] = 0.7;
  const ScoreTest test = conclude(scoreOf(frame.at(truth, 0.0), frame.basis(SetupLayout::kFocal, 1)));
  ASSERT_TRUE(test.determined);
  EXPECT_NEAR(test.estimate[0], 0.7, 1e-9);  // Linear and without noise: exact.
}

TEST(ScoreTest, TellsWhatTheParameterDoesToThePose) {
  LinearFrame frame(2);
  Eigen::VectorXd truth = frame.nothing();
  truth.head<6>() << 1.0, -2.0, 3.0, 0.5, 0.4, -0.3;
  truth[frame.focal()] = 0.7;
  // The pose that is best with the parameter at zero, and the evidence there.
  const SetupEvidence at_zero = frame.at(truth, 0.0);
  const Twist best = -Matrix6d(at_zero.matrix.topLeftCorner<6, 6>()).ldlt().solve(at_zero.gradient.head<6>());
  Eigen::VectorXd rest = truth;
  rest.head<6>() -= best;
  const ScoreTest test = conclude(scoreOf(frame.at(rest, 0.0), frame.basis(SetupLayout::kFocal, 1)));
  EXPECT_LT((test.pose_effect - rest.head<6>()).norm(), 1e-9);
  EXPECT_NEAR(test.effect_mm, motionMm(rest.head<6>()), 1e-9);
}

TEST(ScoreTest, ItsSigmaIsTheScatterOfItsEstimates) {
  double sum2 = 0.0;
  double claimed2 = 0.0;
  double deviations2 = 0.0;
  constexpr int kRuns = 300;
  LinearFrame frame(3);
  for (int i = 0; i < kRuns; ++i) {
    const ScoreTest test = conclude(scoreOf(frame.at(frame.nothing(), 0.5), frame.basis(SetupLayout::kCentre, 2)));
    ASSERT_TRUE(test.determined);
    sum2 += test.estimate.squaredNorm();
    claimed2 += test.covariance.trace();
    deviations2 += test.deviations * test.deviations;
  }
  // 600 squares scatter by 6 %; the sandwich of 400 windows with eight parameters fitted is some 4 % too small.
  EXPECT_NEAR(claimed2 / sum2, 1.0, 0.2);
  EXPECT_NEAR(deviations2 / kRuns, 1.0, 0.2);
}

TEST(ScoreTest, FramesAddUp) {
  LinearFrame frame(4);
  Eigen::VectorXd truth = frame.nothing();
  truth[frame.focal()] = 0.7;
  Score sum;
  EXPECT_FALSE(conclude(sum).determined);
  sum.add(scoreOf(frame.at(truth, 0.5), frame.basis(SetupLayout::kFocal, 1)));
  const ScoreTest one = conclude(sum);
  for (int i = 0; i < 3; ++i) sum.add(scoreOf(frame.at(truth, 0.5), frame.basis(SetupLayout::kFocal, 1)));
  const ScoreTest four = conclude(sum);
  EXPECT_NEAR(four.estimate[0], 0.7, 4.0 * std::sqrt(four.covariance(0, 0)));
  // Four frames of equal noise: half the σ, within what 400 windows know of it.
  EXPECT_NEAR(std::sqrt(one.covariance(0, 0) / four.covariance(0, 0)), 2.0, 0.2);
}

TEST(ScoreTest, WhatThePoseImitatesIsNotDetermined) {
  LinearFrame frame(5);
  frame.design().col(frame.focal()) = 2.0 * frame.design().col(2) - frame.design().col(4);
  Eigen::VectorXd truth = frame.nothing();
  truth[frame.focal()] = 0.7;
  EXPECT_FALSE(conclude(scoreOf(frame.at(truth, 0.1), frame.basis(SetupLayout::kFocal, 1))).determined);
  EXPECT_TRUE(conclude(scoreOf(frame.at(truth, 0.1), frame.basis(SetupLayout::kCentre, 2))).determined);
}

TEST(ScoreTest, MotionIsThatOfPointsOnASphere) {
  EXPECT_DOUBLE_EQ(motionMm((Twist() << 3.0, 0.0, 4.0, 0.0, 0.0, 0.0).finished()), 5.0);
  // About an axis the mean square distance of a sphere's points is two thirds of r².
  EXPECT_NEAR(motionMm((Twist() << 0.0, 0.0, 0.0, 0.0, 0.01, 0.0).finished()),
              0.01 * kTargetRadiusMm * std::sqrt(2.0 / 3.0), 1e-12);
}

}  // namespace
}  // namespace xray_registration
