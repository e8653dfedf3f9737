#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "xray_registration/drr/step_sums.h"

namespace xray_registration {

/// What bounds one run of the solver. Lengths as seen in the image: a step of `stop_mm` is the mean motion of points
/// within `radius_mm` of the centre, with depth motion scaled by what it moves in the image.
struct GaussNewtonOptions {
  int max_steps = 10;
  double stop_mm = 0.02;
  double radius_mm = 60.0;
  double depth_mm = 1000.0;   ///< From the source to the CT's centre: scales what depth motion is worth.
  double max_step_mm = 20.0;  ///< Trust region: longer steps are shortened.
  double max_step_rad = 0.2;
  double initial_damping = 1e-3;
  /// The last step, which no evaluation follows, is taken when it is shorter than this: it saves one evaluation of the
  /// dearest level.
  double max_untested_step_mm = 0.0;
};

struct GaussNewtonResult {
  RigidTransform T_camera_ct = RigidTransform::Identity();
  StepSums sums;           ///< At the result.
  bool converged = false;  ///< The last step was below stop_mm, or below max_untested_step_mm and taken.
  /// Singular, or not finite: at the start, at every other pose, or at the last pose before the steps became short. The
  /// pose is the best one before it, and nothing says that it is a minimum.
  bool failed = false;
  int steps = 0;  ///< Evaluations of the objective; 0 when it declined the first one, then the pose is the start.
};

/// Gauss-Newton with Levenberg-Marquardt damping, one step at a time: whoever drives it evaluates the objective at
/// nextPose() and hands the sums to observe(), so that many descents can share one launch. The damping follows the
/// ratio of achieved to predicted decrease (K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for non-linear least
/// squares problems", 2004, 3.2). One evaluation a step gives cost, gradient and matrix; the cost never increases.
class DampedDescent {
 public:
  /// The twist is about `centre_ct_mm`, in the camera's axes.
  DampedDescent(const RigidTransform& T_camera_ct_start, const Eigen::Vector3d& centre_ct_mm,
                const GaussNewtonOptions& options);

  bool done() const { return done_; }
  const RigidTransform& nextPose() const { return candidate_; }
  void observe(const StepSums& sums);
  const GaussNewtonResult& result() const { return result_; }

 private:
  void propose();
  void end(bool step_is_short);

  GaussNewtonOptions options_;
  Eigen::Vector3d centre_ct_mm_;
  GaussNewtonResult result_;
  RigidTransform candidate_;
  Twist step_ = Twist::Zero();
  double damping_;
  double growth_ = 2.0;
  bool latest_is_finite_ = true;  ///< Of the poses after the start; true before the first.
  bool saw_finite_neighbour_ = false;
  bool done_ = false;
};

/// The objective at a pose; the twist is about `centre_ct_mm`, in the first camera's axes. Nothing when it declines (a
/// budget is used up): the solver then ends where it is, unconverged.
using Objective = std::function<std::optional<StepSums>(const RigidTransform& T_camera_ct)>;

GaussNewtonResult minimise(const Objective& objective, const RigidTransform& T_camera_ct_start,
                           const Eigen::Vector3d& centre_ct_mm, const GaussNewtonOptions& options);

/// The same from many starts side by side, one batch of evaluations a step. An empty batch declines.
using BatchObjective = std::function<std::vector<StepSums>(const std::vector<RigidTransform>& T_camera_ct)>;

/// Many descents, one batch of evaluations at a time.
class ManyDescents {
 public:
  ManyDescents(const std::vector<RigidTransform>& starts, const Eigen::Vector3d& centre_ct_mm,
               const GaussNewtonOptions& options);
  /// One step of all that are not done; false when all are, or the objective declined.
  bool advance(const BatchObjective& objective);
  /// In the order of the starts.
  std::vector<GaussNewtonResult> results() const;

 private:
  std::vector<DampedDescent> descents_;
};

std::vector<GaussNewtonResult> minimiseMany(const BatchObjective& objective, const std::vector<RigidTransform>& starts,
                                            const Eigen::Vector3d& centre_ct_mm, const GaussNewtonOptions& options);

/// The damped step -(A + λ diag A)⁻¹ g, or nothing when the matrix is not positive definite or not finite.
bool dampedStep(const StepSums& sums, double damping, Twist* step);

}  // namespace xray_registration
