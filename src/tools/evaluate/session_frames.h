#pragma once

#include <vector>

#include "xray_registration/common/log.h"
#include "xray_registration/evaluation/trials.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// The session's frames that have a true pose, at most `limit` of them in their order, in memory as they came. Frames
/// without a pose are passed over; those that the pipeline would refuse for their pixels are named to the logger.
/// @throws std::runtime_error when none is left.
std::vector<EvaluationFrame> sessionFrames(const BagSession& session, const NodeParameters& parameters,
                                           std::size_t limit, const Logger& logger);

}  // namespace xray_registration::tools
