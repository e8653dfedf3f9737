#include "registration/tracking_level.h"

#include <cmath>

#include "registration/judgement.h"

namespace xray_registration {
namespace {

/// A tracked frame is solved on two levels, and the coarser one needs a shadow of some size.
int coarsestToEndOn(FrameObjective* objective, const RigidTransform& T_camera_ct) {
  return objective->views().coarsestLevel(T_camera_ct) - 1;
}

}  // namespace

double inPlaneSigma(const Matrix6d& covariance, const RigidTransform& T_camera_ct) {
  double variance = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d lever_mm = T_camera_ct.linear() * (kTargetRadiusMm * Eigen::Vector3d::Unit(axis));
    const Eigen::Matrix<double, 2, 6> moved = twistMovedBy(lever_mm).topRows<2>();
    variance += (moved * covariance * moved.transpose()).trace() / 3.0;
  }
  return std::sqrt(std::max(variance, 0.0));
}

int levelsToSpare(FrameObjective* objective, const Solution& solution, double precision_mm) {
  const Similarity similarity = objective->options().similarity;
  const auto isCertain = [&](const StepSums& sums) {
    const Matrix6d covariance = covarianceOf(sums, finestSpan(similarity));
    return covariance.trace() > 0.0 && inPlaneSigma(covariance, solution.T_camera_ct) <= precision_mm;
  };
  if (!(precision_mm > 0.0) || !isCertain(solution.sums)) return 0;
  const int coarsest = coarsestToEndOn(objective, solution.T_camera_ct);
  int level = 0;
  while (level < coarsest) {
    // As a tracked frame will see it: its finest level's windows.
    const Stage stage{level + 1, finestSpan(similarity), 1};
    const std::vector<StepSums> seen = objective->evaluate(stage, solution.robust_scale2, {solution.T_camera_ct});
    if (seen.empty() || !seen.front().finite() || !isCertain(seen.front())) break;
    ++level;
  }
  return level;
}

}  // namespace xray_registration
