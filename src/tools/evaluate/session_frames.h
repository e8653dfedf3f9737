#pragma once

#include <vector>

#include "xray_registration/common/log.h"
#include "xray_registration/evaluation/trials.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// The session's frames that have a true pose, at most `limit` of them in their order, prepared by the pipeline and
/// timed. Frames without a pose are passed over; those that cannot be used are named to the logger.
/// @throws std::runtime_error when none is left.
std::vector<EvaluationFrame> sessionFrames(const BagSession& session, const RegistrationPipeline& pipeline,
                                           std::size_t limit, const Logger& logger);

}  // namespace xray_registration::tools
