#pragma once

#include <std_msgs/Header.h>
#include <xray_registration/RegistrationStatus.h>

#include <vector>

#include "xray_registration/pipeline/body_parameters.h"
#include "xray_registration/pipeline/node_statistics.h"
#include "xray_registration/pipeline/registration_pipeline.h"

namespace xray_registration {

/// RegistrationStatus::state.
std::uint8_t toMessageState(TrackingState state);

/// What became of a frame, as a message: all that the outcome tells, with an entry for each of `bodies`, whether they
/// were looked at or not. Left to the caller: latency, counts, and the names of device and CT.
RegistrationStatus statusMessage(const FrameOutcome& outcome, const std_msgs::Header& header,
                                 const std::vector<BodyParameters>& bodies = {});

/// State, counters, device and CT of the node; the frame's own fields are left alone.
void setNodeFields(const NodeStatistics::Snapshot& values, RegistrationStatus* message);

}  // namespace xray_registration
