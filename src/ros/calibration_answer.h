#pragma once

#include <xray_registration/Calibrate.h>

#include <string>
#include <vector>

#include "xray_registration/registration/geometry_calibration.h"
#include "xray_registration/ros/view_synchroniser.h"

namespace xray_registration {

/// What ~calibrate answers: the messages as they would have to be, and in words what differs from what was told.
/// @param names  Of the views.
/// @param told  A frame with all views that `found` started from; its stamps and frames are those of the answer.
/// @param T_view_first  Of the views, as told.
Calibrate::Response calibrationAnswer(const std::vector<std::string>& names, const FrameMessages& told,
                                      const GeometryCalibration& found,
                                      const std::vector<RigidTransform>& T_view_first);

}  // namespace xray_registration
