#include "xray_registration/registration/tracker.h"

#include <algorithm>

namespace xray_registration {
namespace {

PredictionLimits limitsOf(const TrackerOptions& options) {
  return {options.max_prediction_gap_s, options.max_velocity_mm_s, options.max_velocity_rad_s};
}

}  // namespace

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

void Tracker::followBodies(std::size_t count) { bodies_.assign(count, {}); }

void Tracker::setPose(const RigidTransform& T_camera_ct) { setPose(T_camera_ct, {}); }

void Tracker::setPose(const RigidTransform& T_camera_ct, const std::vector<RigidTransform>& T_ct_bodies) {
  reset();
  given_ = T_camera_ct;
  for (std::size_t i = 0; i < std::min(bodies_.size(), T_ct_bodies.size()); ++i) {
    bodies_[i].T_ct_body_given = T_ct_bodies[i];
  }
}

void Tracker::setBodyPose(std::size_t body, const RigidTransform& T_ct_body) {
  FollowedBody given;
  given.T_ct_body_given = T_ct_body;
  bodies_.at(body) = given;
}

void Tracker::reset() {
  given_.reset();
  history_.clear();
  followBodies(bodies_.size());
  refused_in_a_row_ = 0;
  state_ = TrackingState::kWaitingForPose;
}

std::optional<RigidTransform> Tracker::prediction(double stamp_s,
                                                  const std::optional<RigidTransform>& T_camera_now_camera_last) const {
  if (given_) return given_;
  if (history_.empty()) return std::nullopt;
  if (T_camera_now_camera_last) return RigidTransform(*T_camera_now_camera_last * history_.last());
  // A refused frame in between means that the velocity is stale: stay where the CT was last seen.
  if (refused_in_a_row_ > 0) return history_.last();
  return history_.predicted(stamp_s, centre_ct_, limitsOf(options_));
}

std::vector<BodyStart> Tracker::bodyPredictions(double stamp_s) const {
  std::vector<BodyStart> starts;
  for (const FollowedBody& body : bodies_) {
    if (body.history.empty()) {
      starts.push_back({body.T_ct_body_given, false});
    } else if (body.refused_in_a_row > 0) {
      starts.push_back({body.history.last(), false});
    } else {
      starts.push_back({body.history.predicted(stamp_s, body.centre_ct_mm, limitsOf(options_)), true});
    }
  }
  return starts;
}

void Tracker::noteBodies(double stamp_s, const RegistrationResult& result) {
  for (std::size_t i = 0; i < std::min(bodies_.size(), result.bodies.size()); ++i) {
    const BodyResult& seen = result.bodies[i];
    FollowedBody& body = bodies_[i];
    if (seen.accepted) {
      body.history.add(stamp_s, result.T_camera_ct.inverse() * seen.T_camera_body);
      body.centre_ct_mm = seen.centre_ct_mm;
      body.refused_in_a_row = 0;
      continue;
    }
    // What was lost for long may be anywhere: the search begins where the CT has it.
    if (++body.refused_in_a_row >= options_.frames_until_lost) body.history.clear();
  }
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
    if (!bodies_.empty()) result.bodies = registrar->registerBodies(bodyPredictions(stamp_s), &result);
    noteBodies(stamp_s, result);
    given_.reset();
    history_.add(stamp_s, result.T_camera_ct);
    refused_in_a_row_ = 0;
    state_ = TrackingState::kTracking;
    return result;
  }
  noteUnusable();
  return result;
}

void Tracker::noteUnusable() {
  ++refused_in_a_row_;
  if (refused_in_a_row_ >= options_.frames_until_lost) loseTrack();
}

void Tracker::loseTrack() {
  if (state_ != TrackingState::kTracking) return;
  state_ = TrackingState::kLost;
  history_.forgetVelocity();
}

}  // namespace xray_registration
