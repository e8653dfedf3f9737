#pragma once

#include <string>
#include <vector>

#include "tools/benchmark/measure.h"
#include "xray_registration/common/log.h"

namespace xray_registration::tools {

/// Follows a recorded session from its first true pose and times every frame from the image in memory to the verdict:
/// tracked_frame/<bag> for the fast method, tracked_frame/paper/<bag> for the paper's (one view only). `passes` over
/// the session.
/// @throws std::runtime_error when the session has no true pose to start from.
std::vector<BenchmarkRow> measureTrackedFrames(const std::string& ct, const std::string& bag,
                                               const std::vector<std::string>& views, const std::string& device,
                                               int passes, const Logger& logger);

}  // namespace xray_registration::tools
