#include "registration/judgement.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "registration/frame_objective.h"
#include "registration/normal_matrix.h"
#include "registration/stage.h"
#include "xray_registration/registration/verdict.h"

namespace xray_registration {

/// A⁻¹ B A⁻¹ (P. J. Huber, 1967): A the curvature, B the variance of the gradient, from the scatter of the windows'
/// own gradients, so that noise, its correlation inside a window and model errors are all in it. Each tile stands in
/// span² windows, whose gradients therefore move together.
Matrix6d covarianceOf(const StepSums& sums, int span) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scaledToRadius(sums.matrix, kTargetRadiusMm));
  if (eigen.info() != Eigen::Success || !(eigen.eigenvalues()[0] > 0.0)) return Matrix6d::Zero();
  const Matrix6d scaled_inverse =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  const Matrix6d inverse = scaledToRadius(scaled_inverse, kTargetRadiusMm);
  const double overlap = std::max(1, span * span);
  // Gradients at the optimum are smaller than at the truth: six parameters were fitted to them (J. G. MacKinnon, H.
  // White, 1985). Tiles of 64 pixels are what is independent.
  const double tiles = std::max(sums.content / overlap / 64.0, 12.0);
  const double fitted = std::pow(tiles / (tiles - 6.0), 2);
  const Matrix6d covariance = inverse * (fitted * overlap * sums.scatter) * inverse;
  return 0.5 * (covariance + covariance.transpose());
}

void describe(const Solution& solution, int span, RegistrationResult* result) {
  const StepSums& sums = solution.sums;
  result->T_camera_ct = solution.T_camera_ct;
  result->similarity = solution.likeness();
  result->inlier_fraction = sums.inlier_fraction;
  result->condition_number = conditionNumber(sums.matrix, kTargetRadiusMm);
  result->residual = sums.weight > 0.0 ? std::sqrt(std::max(2.0 * sums.cost / sums.weight, 0.0)) : 0.0;
  result->covariance = covarianceOf(sums, span);
}

void judge(const DeviceViews& views, const Solution& solution, const SolveHistory& history,
           const RegistrarOptions& options, RegistrationResult* result) {
  VerdictCues cues;
  cues.finite = solution.sums.finite() && solution.T_camera_ct.matrix().allFinite();
  if (cues.finite) describe(solution, finestSpan(options.similarity), result);
  result->converged = solution.converged;
  const Eigen::Vector3d centre = result->T_camera_ct * views.centreCt();
  cues.in_view = views.seesCentre(result->T_camera_ct);
  cues.exceeded_steps = history.exceeded_steps;
  cues.converged = solution.converged && !solution.failed;
  cues.similarity = result->similarity;
  cues.inlier_fraction = result->inlier_fraction;
  cues.condition_number = result->condition_number;
  cues.tracking = history.predicted;
  // A search knows how far it looked; what the descent found far outside, and is not sure, is another optimum.
  if (history.searched && options.search && cues.similarity < options.accept.sure_similarity) {
    cues.search_range_mm = 2.0 * options.search_translation_mm;
    cues.search_range_rad = 2.0 * options.search_rotation_rad;
  }
  if (history.searched && options.reach_translation_mm > 0.0) cues.search_range_mm = options.reach_translation_mm;
  if (history.searched && options.reach_rotation_rad > 0.0) cues.search_range_rad = options.reach_rotation_rad;
  cues.jump_mm = (centre - history.T_camera_ct_start * views.centreCt()).norm();
  cues.jump_rad = rotationAngleBetween(result->T_camera_ct, history.T_camera_ct_start);
  cues.has_second_solve = history.confirmation.has_value();
  cues.found_similarity = history.found_similarity;
  cues.found_inlier_fraction = history.found_inlier_fraction;
  if (history.confirmation) {
    cues.disagreement_mm = history.confirmation->disagreement_mm;
    cues.rival_similarity = history.confirmation->rival.similarity;
    cues.rival_mm = history.confirmation->rival.distance_mm;
    result->compared = true;
    result->rival_similarity = cues.rival_similarity;
    result->disagreement_mm = cues.disagreement_mm;
  }
  result->reason = reasonToRefuse(cues, thresholdsFor(views.size(), options.accept));
  result->accepted = result->reason.empty();
}

}  // namespace xray_registration
