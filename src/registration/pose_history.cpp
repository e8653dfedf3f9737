#include "xray_registration/registration/pose_history.h"

#include <algorithm>

namespace xray_registration {

void PoseHistory::add(double stamp_s, const RigidTransform& T) {
  before_last_ = last_;
  last_ = Seen{stamp_s, T};
}

void PoseHistory::clear() {
  last_.reset();
  before_last_.reset();
}

RigidTransform PoseHistory::predicted(double stamp_s, const Eigen::Vector3d& centre_mm,
                                      const PredictionLimits& limits) const {
  if (!before_last_) return last_->T;
  const double step_s = last_->stamp_s - before_last_->stamp_s;
  const double ahead_s = stamp_s - last_->stamp_s;
  if (step_s <= 0.0 || ahead_s <= 0.0 || ahead_s > limits.max_gap_s || step_s > limits.max_gap_s) return last_->T;
  Twist velocity = twistBetween(before_last_->T, last_->T, before_last_->T * centre_mm) / step_s;
  const double too_fast = std::max(velocity.head<3>().norm() / limits.max_velocity_mm_s,
                                   velocity.tail<3>().norm() / limits.max_velocity_rad_s);
  if (too_fast > 1.0) velocity /= too_fast;
  return updatedPose(last_->T, velocity * ahead_s, last_->T * centre_mm);
}

}  // namespace xray_registration
