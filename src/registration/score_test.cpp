#include "registration/score_test.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace xray_registration {
namespace {

/// Share of a parameter's own effect on the images that no motion of the pose imitates, below which single precision
/// and the CT's own errors are what is seen.
constexpr double kOwnShare = 1e-5;

}  // namespace

double motionMm(const Twist& twist) {
  // Over a sphere the mean of |ω × r|² is 2/3 |ω|² r².
  return std::sqrt(twist.head<3>().squaredNorm() +
                   2.0 / 3.0 * kTargetRadiusMm * kTargetRadiusMm * twist.tail<3>().squaredNorm());
}

void Score::add(const Score& other) {
  if (other.empty()) return;
  if (empty()) {
    *this = other;
    return;
  }
  score += other.score;
  curvature += other.curvature;
  scatter += other.scatter;
  own += other.own;
  follows = other.follows;
}

void Score::fade(double kept) {
  score *= kept;
  curvature *= kept;
  scatter *= kept;
  own *= kept;
}

Score scoreOf(const SetupEvidence& evidence, const Eigen::MatrixXd& basis) {
  Score score;
  const Matrix6d pose = evidence.matrix.topLeftCorner<6, 6>();
  const Eigen::LDLT<Matrix6d> ldlt(pose);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0.0)) return score;
  const Eigen::MatrixXd cross = evidence.matrix.topRows<6>() * basis;
  const Eigen::MatrixXd own = basis.transpose() * evidence.matrix * basis;
  score.follows = ldlt.solve(cross);
  score.curvature = own - cross.transpose() * score.follows;
  score.own = own.diagonal();
  const Eigen::MatrixXd parts =
      basis.transpose() * evidence.gradients - score.follows.transpose() * evidence.gradients.topRows<6>();
  score.score = parts.rowwise().sum();
  score.scatter = parts * parts.transpose();
  return score;
}

ScoreTest conclude(const Score& score) {
  ScoreTest test;
  if (score.empty() || !(score.own.minCoeff() > 0.0)) return test;
  const Eigen::VectorXd scale = score.own.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * score.curvature * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  if (eigen.info() != Eigen::Success || !(eigen.eigenvalues()[0] > kOwnShare)) return test;
  const Eigen::MatrixXd inverse = scale.asDiagonal() * eigen.eigenvectors() *
                                  eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose() *
                                  scale.asDiagonal();
  test.estimate = -inverse * score.score;
  test.covariance = inverse * score.scatter * inverse;
  test.gain = -score.score.dot(test.estimate);
  test.pose_effect = -score.follows * test.estimate;
  test.effect_mm = motionMm(test.pose_effect);
  const Eigen::LDLT<Eigen::MatrixXd> spread(test.covariance);
  if (spread.info() != Eigen::Success || !(spread.vectorD().minCoeff() > 0.0)) return test;
  const double chi2 = std::max(test.estimate.dot(spread.solve(test.estimate)), 0.0);
  test.deviations = std::sqrt(chi2 / static_cast<double>(score.score.size()));
  test.determined = std::isfinite(test.deviations) && test.estimate.allFinite();
  return test;
}

}  // namespace xray_registration
