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

DampedDescent::DampedDescent(const RigidTransform& T_camera_ct_start, const Eigen::Vector3d& centre_ct_mm,
                             const GaussNewtonOptions& options)
    : options_(options), centre_ct_mm_(centre_ct_mm), candidate_(T_camera_ct_start), damping_(options.initial_damping) {
  result_.T_camera_ct = T_camera_ct_start;
}

void DampedDescent::observe(const StepSums& sums) {
  const bool first = result_.steps == 0;
  ++result_.steps;
  const double achieved = result_.sums.cost - sums.cost;
  if (!first) {
    latest_is_finite_ = sums.finite();
    saw_finite_neighbour_ |= latest_is_finite_;
  }
  if (first) {
    result_.sums = sums;
  } else if (latest_is_finite_ && achieved > 0.0) {
    const double predicted = -step_.dot(result_.sums.gradient + 0.5 * result_.sums.matrix * step_);
    const double ratio = predicted > 0.0 ? std::min(achieved / predicted, 1.0) : 1.0;
    damping_ = std::max(damping_ * std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3)), 1e-6);
    growth_ = 2.0;
    result_.T_camera_ct = candidate_;
    result_.sums = sums;
  } else {
    damping_ *= growth_;
    growth_ *= 2.0;
    if (damping_ > 1e6) return end(true);  // No direction leads down: a minimum to rounding.
  }
  propose();
}

void DampedDescent::propose() {
  if (!dampedStep(result_.sums, damping_, &step_)) {
    result_.failed = true;
    done_ = true;
    return;
  }
  shorten(&step_, options_);
  const double motion_mm = imageMotionMm(step_, options_);
  candidate_ = updatedPose(result_.T_camera_ct, step_, result_.T_camera_ct * centre_ct_mm_);
  const bool small = motion_mm < options_.stop_mm;
  if (!small && result_.steps < options_.max_steps) return;
  const bool untested = motion_mm < options_.max_untested_step_mm;
  end(small || untested);
  if (result_.converged && untested) result_.T_camera_ct = candidate_;
}

void DampedDescent::end(bool step_is_short) {
  done_ = true;
  // Beside a place without a finite cost it is the damping that made the step short, not a minimum.
  result_.converged = step_is_short && latest_is_finite_;
  result_.failed = !latest_is_finite_ && (step_is_short || !saw_finite_neighbour_);
}

GaussNewtonResult minimise(const Objective& objective, const RigidTransform& T_camera_ct_start,
                           const Eigen::Vector3d& centre_ct_mm, const GaussNewtonOptions& options) {
  DampedDescent descent(T_camera_ct_start, centre_ct_mm, options);
  while (!descent.done()) {
    const std::optional<StepSums> sums = objective(descent.nextPose());
    if (!sums) break;
    descent.observe(*sums);
  }
  return descent.result();
}

ManyDescents::ManyDescents(const std::vector<RigidTransform>& starts, const Eigen::Vector3d& centre_ct_mm,
                           const GaussNewtonOptions& options) {
  descents_.reserve(starts.size());
  for (const RigidTransform& start : starts) descents_.emplace_back(start, centre_ct_mm, options);
}

bool ManyDescents::advance(const BatchObjective& objective) {
  std::vector<RigidTransform> poses;
  std::vector<DampedDescent*> waiting;
  for (DampedDescent& descent : descents_) {
    if (descent.done()) continue;
    poses.push_back(descent.nextPose());
    waiting.push_back(&descent);
  }
  if (waiting.empty()) return false;
  const std::vector<StepSums> sums = objective(poses);
  if (sums.size() != poses.size()) return false;
  for (std::size_t i = 0; i < waiting.size(); ++i) waiting[i]->observe(sums[i]);
  return true;
}

std::vector<GaussNewtonResult> ManyDescents::results() const {
  std::vector<GaussNewtonResult> results;
  results.reserve(descents_.size());
  for (const DampedDescent& descent : descents_) results.push_back(descent.result());
  return results;
}

std::vector<GaussNewtonResult> minimiseMany(const BatchObjective& objective, const std::vector<RigidTransform>& starts,
                                            const Eigen::Vector3d& centre_ct_mm, const GaussNewtonOptions& options) {
  ManyDescents descents(starts, centre_ct_mm, options);
  while (descents.advance(objective)) {
  }
  return descents.results();
}

}  // namespace xray_registration
