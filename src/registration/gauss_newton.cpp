#include "xray_registration/registration/gauss_newton.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace xray_registration {
namespace {

/// Size of a step as motion in the image, back-projected to the CT's depth, mm.
double imageMotionMm(const Twist& step, const GaussNewtonOptions& options) {
  const double depth_worth = options.radius_mm / options.depth_mm;
  return std::sqrt(step[0] * step[0] + step[1] * step[1] + std::pow(depth_worth * step[2], 2) +
                   std::pow(options.radius_mm, 2) * step.tail<3>().squaredNorm());
}

void shorten(Twist* step, const GaussNewtonOptions& options) {
  // Depth alone may move further: it is the weak direction.
  const double in_plane = step->head<2>().norm() / options.max_step_mm;
  const double depth = std::abs((*step)[2]) / (4.0 * options.max_step_mm);
  const double turn = step->tail<3>().norm() / options.max_step_rad;
  const double excess = std::max({in_plane, depth, turn});
  if (excess > 1.0) *step /= excess;
}

}  // namespace

bool dampedStep(const StepSums& sums, double damping, Twist* step) {
  if (!sums.finite()) return false;
  // Columns are scaled to unit diagonal first: millimetres and radians differ by three orders of magnitude.
  const Twist diagonal = sums.matrix.diagonal();
  if ((diagonal.array() <= 0.0).any()) return false;
  const Twist scale = diagonal.cwiseSqrt().cwiseInverse();
  Matrix6d scaled = scale.asDiagonal() * sums.matrix * scale.asDiagonal();
  scaled.diagonal().array() += damping;
  const Eigen::LDLT<Matrix6d> ldlt(scaled);
  // A pivot of 1e-9 leaves no digit of single-precision sums.
  if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 1e-9)) return false;
  *step = scale.asDiagonal() * ldlt.solve(-(scale.asDiagonal() * sums.gradient));
  return step->allFinite();
}

GaussNewtonResult minimise(const Objective& objective, const RigidTransform& T_camera_ct_start,
                           const Eigen::Vector3d& centre_ct_mm, const GaussNewtonOptions& options) {
  GaussNewtonResult result;
  result.T_camera_ct = T_camera_ct_start;
  result.sums = objective(T_camera_ct_start);
  result.steps = 1;
  double damping = options.initial_damping;
  double growth = 2.0;
  while (true) {
    Twist step;
    if (!dampedStep(result.sums, damping, &step)) {
      result.failed = true;
      return result;
    }
    shorten(&step, options);
    const double motion_mm = imageMotionMm(step, options);
    if (motion_mm < options.stop_mm) {
      result.converged = true;
      return result;
    }
    if (result.steps >= options.max_steps) {
      if (motion_mm < options.max_untested_step_mm) {
        result.T_camera_ct = updatedPose(result.T_camera_ct, step, result.T_camera_ct * centre_ct_mm);
        result.converged = true;
      }
      return result;
    }
    const RigidTransform moved = updatedPose(result.T_camera_ct, step, result.T_camera_ct * centre_ct_mm);
    const StepSums sums = objective(moved);
    ++result.steps;
    const double predicted = -(sums.finite() ? step.dot(result.sums.gradient + 0.5 * result.sums.matrix * step) : 0.0);
    const double achieved = result.sums.cost - sums.cost;
    if (sums.finite() && achieved > 0.0) {
      const double ratio = predicted > 0.0 ? achieved / predicted : 1.0;
      damping = std::max(damping * std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * std::min(ratio, 1.0) - 1.0, 3)), 1e-6);
      growth = 2.0;
      result.T_camera_ct = moved;
      result.sums = sums;
    } else {
      damping *= growth;
      growth *= 2.0;
      if (damping > 1e6) {
        result.converged = true;  // No direction leads down: the pose is a minimum to rounding.
        return result;
      }
    }
  }
}

}  // namespace xray_registration
