#pragma once

#include <string>
#include <vector>

#include "tools/calibrate/session/told_session.h"
#include "xray_registration/pipeline/registration_pipeline.h"

namespace xray_registration::tools {

/// A frame of the session with the pose that was found for it.
struct RegisteredFrame {
  std::size_t index = 0;  ///< In the bag.
  RigidTransform T_camera_ct = RigidTransform::Identity();
};

struct FrameChoice {
  std::vector<RegisteredFrame> frames;  ///< In the bag's order.
  std::size_t tried = 0;
  std::size_t alike = 0;  ///< Registered, and left out for others with more different poses.
  std::size_t failed = 0;
  std::string why_failed;  ///< The last one, in words.
};

/// Registers frames spread evenly over the session, each from the one before, and chooses `most` whose poses differ the
/// most. A frame need not be accepted: the set-up as told may be what is wrong. But X-ray and DRR have to look alike.
/// @throws std::runtime_error when the device fails.
FrameChoice chooseFrames(const ToldSession& session, const RigidTransform& start, std::size_t most,
                         RegistrationPipeline* pipeline);

}  // namespace xray_registration::tools
