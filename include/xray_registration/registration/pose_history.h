#pragma once

#include <Eigen/Core>
#include <optional>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// Bounds of a constant-velocity prediction.
struct PredictionLimits {
  double max_gap_s = 1.0;  ///< Beyond this gap the velocity is not trusted.
  double max_velocity_mm_s = 200.0;
  double max_velocity_rad_s = 2.0;
};

/// The last two poses of something that is followed.
class PoseHistory {
 public:
  void add(double stamp_s, const RigidTransform& T);
  void clear();
  /// The next prediction is the last pose.
  void forgetVelocity() { before_last_.reset(); }

  bool empty() const { return !last_; }
  const RigidTransform& last() const { return last_->T; }  ///< Not empty.

  /// The last pose moved by a bounded constant velocity, that of `centre_mm` and about it; the last pose where nothing
  /// says how fast it moves. Not empty.
  RigidTransform predicted(double stamp_s, const Eigen::Vector3d& centre_mm, const PredictionLimits& limits) const;

 private:
  struct Seen {
    double stamp_s = 0.0;
    RigidTransform T;
  };
  std::optional<Seen> last_;
  std::optional<Seen> before_last_;
};

}  // namespace xray_registration
