#include "xray_registration/ros/status_message.h"

#include "xray_registration/ros/conversions.h"

namespace xray_registration {

std::uint8_t toMessageState(TrackingState state) {
  switch (state) {
    case TrackingState::kWaitingForCt:
      return RegistrationStatus::WAITING_FOR_CT;
    case TrackingState::kWaitingForPose:
      return RegistrationStatus::WAITING_FOR_POSE;
    case TrackingState::kTracking:
      return RegistrationStatus::TRACKING;
    case TrackingState::kLost:
      return RegistrationStatus::LOST;
    case TrackingState::kFault:
      break;
  }
  return RegistrationStatus::FAULT;
}

namespace {

Suspicion toMessage(const SetupSuspicion& suspicion) {
  Suspicion message;
  message.what = suspicion.what;
  message.in_words = suspicion.in_words;
  message.estimate = suspicion.estimate;
  message.sigma = suspicion.sigma;
  message.unit = suspicion.unit;
  message.effect_mm = suspicion.effect_mm;
  message.certain = suspicion.certain;
  return message;
}

}  // namespace

RegistrationStatus statusMessage(const FrameOutcome& outcome, const std_msgs::Header& header) {
  const RegistrationResult& result = outcome.result;
  RegistrationStatus message;
  message.header = header;
  message.state = toMessageState(outcome.state);
  message.accepted = result.accepted;
  message.reason = result.reason;
  if (outcome.registered) message.views_used = outcome.views_used;
  message.views_missing = outcome.views_missing;
  message.iterations = static_cast<std::uint32_t>(result.iterations);
  message.converged = result.converged;
  message.similarity = result.similarity;
  message.residual = result.residual;
  message.inlier_fraction = result.inlier_fraction;
  message.condition_number = result.condition_number;
  message.registered = outcome.registered;
  message.pose = toPose(outcome.registered ? result.T_camera_ct : RigidTransform::Identity());
  for (const SetupSuspicion& suspicion : result.suspicions) message.suspicions.push_back(toMessage(suspicion));
  message.solve_time = result.solve_ms * 1e-3;
  message.upload_time = result.upload_ms * 1e-3;
  return message;
}

void setNodeFields(const NodeStatistics::Snapshot& values, RegistrationStatus* message) {
  message->state = toMessageState(values.state);
  message->frames_received = values.received;
  message->frames_registered = values.registered;
  message->frames_accepted = values.accepted;
  message->frames_dropped = values.dropped;
  message->frames_refused = values.refused;
  message->device = values.device;
  message->ct = values.ct;
}

}  // namespace xray_registration
