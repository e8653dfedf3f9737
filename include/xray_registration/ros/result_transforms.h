#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <std_msgs/Header.h>

#include <vector>

#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// tf of all that was accepted: the CT and each body, from the camera's frame (the header's) or frames/fixed. With
/// invert_tf the CT is the parent; bodies stay children of that frame, which would have several parents otherwise.
std::vector<geometry_msgs::TransformStamped> resultTransforms(const std_msgs::Header& header,
                                                              const RegistrationResult& result,
                                                              const RigidTransform& T_fixed_camera,
                                                              const FrameParameters& frames,
                                                              const std::vector<BodyParameters>& bodies);

/// Why tf cannot hold what is found in an image of this frame: it has no name, or it is the CT's or a body's own. Empty
/// when it can.
std::string frameProblem(const std::string& image_frame, const FrameParameters& frames,
                         const std::vector<BodyParameters>& bodies);

/// Why an image of this frame cannot follow those whose results stand below `until_now`: what is found would have two
/// parents in tf. Empty when it can, and when nothing stands there yet.
std::string frameChangeProblem(const std::string& image_frame, const std::string& until_now,
                               const FrameParameters& frames);

/// Why a start cannot be given in this frame: it is what the registration itself places. Empty when it can.
std::string startFrameProblem(const std::string& frame_id, const FrameParameters& frames,
                              const std::vector<BodyParameters>& bodies);

}  // namespace xray_registration
