#include "xray_registration/ros/status_message.h"

#include <algorithm>

#include "xray_registration/common/escaped.h"
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

BodyStatus toMessage(const BodyResult& body) {
  BodyStatus message;
  message.accepted = body.accepted;
  message.reason = escaped(body.reason);
  message.solved = body.solved;
  message.pose = toPose(body.solved ? body.T_camera_body : RigidTransform::Identity());
  if (!body.solved) return message;
  message.iterations = static_cast<std::uint32_t>(body.iterations);
  message.similarity = body.similarity;
  message.inlier_fraction = body.inlier_fraction;
  return message;
}

/// A body that nobody looked at: the frame was of no use, or where the CT is, is not known.
BodyResult notLookedAt(const FrameOutcome& outcome) {
  BodyResult body;
  body.reason = outcome.registered ? "the CT around it was not accepted" : outcome.result.reason;
  return body;
}

BodyStatus bodyStatus(const BodyParameters& parameters, const FrameOutcome& outcome) {
  const std::vector<BodyResult>& results = outcome.result.bodies;
  const auto found = std::find_if(results.begin(), results.end(),
                                  [&](const BodyResult& result) { return result.name == parameters.name; });
  BodyStatus message = toMessage(found == results.end() ? notLookedAt(outcome) : *found);
  message.name = parameters.name;
  message.frame = parameters.frame;
  return message;
}

}  // namespace

RegistrationStatus statusMessage(const FrameOutcome& outcome, const std_msgs::Header& header,
                                 const std::vector<BodyParameters>& bodies) {
  const RegistrationResult& result = outcome.result;
  RegistrationStatus message;
  message.header = header;
  message.state = toMessageState(outcome.state);
  message.accepted = result.accepted;
  message.reason = escaped(result.reason);
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
  for (const BodyParameters& body : bodies) message.bodies.push_back(bodyStatus(body, outcome));
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
