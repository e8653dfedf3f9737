#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "tools/register_bag/frame_record.h"

namespace xray_registration::tools {

/// {"start": …, "frames": […]} (docs/formats.md).
nlohmann::json resultsJson(const RigidTransform& T_camera_ct_start, const Eigen::Vector3d& centre_ct_mm,
                           const std::vector<FrameRecord>& records);

/// On standard output: how many were accepted, of the CT and of each body, and, where the truth is known, the errors.
void printSummary(const std::vector<FrameRecord>& records);

/// @throws std::runtime_error that says what to try, when neither the CT nor a body was accepted in any frame.
void requireSomeAccepted(const std::vector<FrameRecord>& records);

}  // namespace xray_registration::tools
