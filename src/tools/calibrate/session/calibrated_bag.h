#pragma once

#include <geometry_msgs/TransformStamped.h>

#include <string>
#include <vector>

#include "tools/calibrate/session/calibrated_session.h"

namespace xray_registration::tools {

/// Copies a bag with the calibrated camera_info and /tf_static in place of the recorded ones.
/// @throws std::runtime_error naming the file.
void writeCalibratedBag(const std::string& input, const std::string& output,
                        const std::vector<CalibratedSessionView>& views);

/// Static transforms with the calibrated relative poses: a view's own transform to its parent is changed, or, where the
/// first view hangs below it, those of its children. Everything else stays where it is.
std::vector<geometry_msgs::TransformStamped> correctedTransforms(std::vector<geometry_msgs::TransformStamped> all,
                                                                 const std::vector<CalibratedSessionView>& views);

}  // namespace xray_registration::tools
