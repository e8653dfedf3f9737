#include "registration/setup_solver.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "registration/score_test.h"

namespace xray_registration {
namespace {

/// A step that moves targets less is the end; the parameters follow the pose.
constexpr double kStopMm = 0.02;
constexpr double kMostDamping = 1e4;

/// The damped step in the layout; empty when the matrix has no inverse.
Eigen::VectorXd stepOf(const SetupEvidence& evidence, const Eigen::MatrixXd& free, double damping) {
  const Eigen::MatrixXd matrix = free.transpose() * evidence.matrix * free;
  const Eigen::VectorXd gradient = free.transpose() * evidence.gradient;
  if (!(matrix.diagonal().minCoeff() > 0.0)) return {};
  const Eigen::VectorXd scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  scaled.diagonal().array() += damping;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(scaled);
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 1e-9)) return {};
  const Eigen::VectorXd step = free * (scale.asDiagonal() * ldlt.solve(-(scale.asDiagonal() * gradient)));
  return step.allFinite() ? step : Eigen::VectorXd();
}

/// The pose's six, then the basis.
Eigen::MatrixXd withPose(const Eigen::MatrixXd& basis) {
  Eigen::MatrixXd free = Eigen::MatrixXd::Zero(basis.rows(), 6 + basis.cols());
  free.topLeftCorner<6, 6>().setIdentity();
  free.rightCols(basis.cols()) = basis;
  return free;
}

}  // namespace

std::optional<SetupSolution> solveSetup(SetupObjective* objective, const Stage& stage, double robust_scale2,
                                        const Eigen::MatrixXd& basis, const Setup& start) {
  std::optional<SetupEvidence> first = objective->evaluate(start, stage, robust_scale2);
  if (!first || !first->finite()) return std::nullopt;
  SetupSolution best{start, std::move(*first)};
  const Eigen::MatrixXd free = withPose(basis);
  double damping = 1e-3;
  for (int i = 1; i < stage.max_steps && damping < kMostDamping; ++i) {
    const Eigen::VectorXd step = stepOf(best.evidence, free, damping);
    if (step.size() == 0) {
      damping *= 10.0;
      continue;
    }
    const Setup moved = corrected(best.setup, step, objective->centreCt());
    std::optional<SetupEvidence> evidence = objective->evaluate(moved, stage, robust_scale2);
    if (!evidence) return std::nullopt;
    const bool better = evidence->finite() && evidence->cost < best.evidence.cost;
    if (better) best = {moved, std::move(*evidence)};
    damping = better ? std::max(0.1 * damping, 1e-6) : 10.0 * damping;
    if (better && motionMm(step.head<6>()) < kStopMm) break;
  }
  return best;
}

}  // namespace xray_registration
