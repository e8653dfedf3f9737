#pragma once

#include <string>
#include <vector>

#include "xray_registration/ros/view_synchroniser.h"

namespace xray_registration {

/// Why a view is no new observation; empty for a new image.
std::string heldProblem(const ViewMessage& view);

/// The same of a frame. Empty also where views may be missing (`allow_missing_view`) and one of them is new.
std::string heldProblem(const FrameMessages& frame, const std::vector<std::string>& names, bool allow_missing_view);

/// For how long a view of the frame has been held, s; 0 when none is.
double longestHeld(const FrameMessages& frame);

}  // namespace xray_registration
