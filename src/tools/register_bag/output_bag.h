#pragma once

#include <string>
#include <vector>

#include "tools/register_bag/frame_record.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// Writes all messages of the session's bag but the results of an earlier run, and what the node would have published:
/// status, pose and tf, and pose and tf of each body, accepted ones only.
void writeOutputBag(const std::string& path, const BagSession& session, const std::vector<FrameRecord>& records,
                    const RegistrationPipeline& pipeline);

}  // namespace xray_registration::tools
