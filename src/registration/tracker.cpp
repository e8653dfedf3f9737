#include "xray_registration/registration/tracker.h"

#include <algorithm>

namespace xray_registration {

const char* toString(TrackingState state) {
  switch (state) {
    case TrackingState::kWaitingForCt:
      return "WAITING_FOR_CT";
    case TrackingState::kWaitingForPose:
      return "WAITING_FOR_POSE";
    case TrackingState::kTracking:
      return "TRACKING";
    case TrackingState::kLost:
      return "LOST";
    case TrackingState::kFault:
      return "FAULT";
  }
  return "FAULT";
}

Tracker::Tracker(const TrackerOptions& options) : options_(options) {}

void Tracker::setPose(const RigidTransform& T_camera_ct) {
  reset();
  given_ = T_camera_ct;
}

void Tracker::reset() {
  given_.reset();
  last_.reset();
  before_last_.reset();
  refused_in_a_row_ = 0;
  state_ = TrackingState::kWaitingForPose;
}

std::optional<RigidTransform> Tracker::prediction(double stamp_s,
                                                  const std::optional<RigidTransform>& T_camera_now_camera_last) const {
  if (given_) return given_;
  if (!last_) return std::nullopt;
  if (T_camera_now_camera_last) return RigidTransform(*T_camera_now_camera_last * last_->T_camera_ct);
  // A refused frame in between means that the velocity is stale: stay where the CT was last seen.
  if (!before_last_ || refused_in_a_row_ > 0) return last_->T_camera_ct;

  const double step_s = last_->stamp_s - before_last_->stamp_s;
  const double ahead_s = stamp_s - last_->stamp_s;
  if (step_s <= 0.0 || ahead_s <= 0.0 || ahead_s > options_.max_prediction_gap_s ||
      step_s > options_.max_prediction_gap_s) {
    return last_->T_camera_ct;
  }
  Twist velocity =
      twistBetween(before_last_->T_camera_ct, last_->T_camera_ct, before_last_->T_camera_ct * centre_ct_) / step_s;
  const double too_fast = std::max(velocity.head<3>().norm() / options_.max_velocity_mm_s,
                                   velocity.tail<3>().norm() / options_.max_velocity_rad_s);
  if (too_fast > 1.0) velocity /= too_fast;
  return updatedPose(last_->T_camera_ct, velocity * ahead_s, last_->T_camera_ct * centre_ct_);
}

RegistrationResult Tracker::process(Registrar* registrar, const std::vector<ViewInput>& views, double stamp_s,
                                    const std::optional<RigidTransform>& T_camera_now_camera_last) {
  centre_ct_ = registrar->centreCt();
  const std::optional<RigidTransform> start = prediction(stamp_s, T_camera_now_camera_last);
  if (!start) {
    RegistrationResult waiting;
    waiting.reason = "no initial pose is known yet";
    return waiting;
  }
  RegistrationResult result = registrar->registerFrame(views, *start, isTracking());
  if (result.accepted) {
    given_.reset();
    before_last_ = last_;
    last_ = Accepted{stamp_s, result.T_camera_ct};
    refused_in_a_row_ = 0;
    state_ = TrackingState::kTracking;
    return result;
  }
  ++refused_in_a_row_;
  if (state_ == TrackingState::kTracking && refused_in_a_row_ >= options_.frames_until_lost) {
    state_ = TrackingState::kLost;
    before_last_.reset();
  }
  return result;
}

}  // namespace xray_registration
