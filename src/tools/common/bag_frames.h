#pragma once

#include <vector>

#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// The parameter `views` for a session: its views' names, or none for a single view without a name.
std::vector<std::string> viewParameter(const BagSession& session);

/// A frame of a bag as the pipeline takes it. What is missing or unreadable is said in the view's `problem`.
std::vector<RawView> rawViews(const BagSession& session, const BagFrame& frame);

}  // namespace xray_registration::tools
