#pragma once

#include <cstdint>
#include <string>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration::tools {

/// The pose turned by exactly so many degrees about the CT's centre and moved by exactly so many millimetres, about an
/// axis and in a direction that the seed chooses. `degrees_mm` is "DEG,MM"; empty text leaves the pose as it is.
/// @throws ArgumentError when the text is not two numbers of at least zero.
RigidTransform disturbedPose(const RigidTransform& T_camera_ct, const std::string& degrees_mm, std::uint64_t seed,
                             const Eigen::Vector3d& centre_ct_mm);

}  // namespace xray_registration::tools
