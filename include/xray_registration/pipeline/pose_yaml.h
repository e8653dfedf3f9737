#pragma once

#include <string>
#include <vector>

#include "xray_registration/geometry/rigid_transform.h"

namespace YAML {
class Node;
}

namespace xray_registration {

/// What poseFromYaml takes, in words.
inline constexpr char kPoseInYaml[] =
    "{position: [x, y, z] in metres, orientation: [x, y, z, w]} or {T_camera_ct_mm: 4x4}";

/// A pose of the CT: {position: [x, y, z] in metres, orientation: [x, y, z, w]}, or {T_camera_ct_mm: 4×4, row by row}.
/// Other keys are the caller's.
/// @throws std::invalid_argument naming the key and what is wrong with it.
RigidTransform poseFromYaml(const YAML::Node& node);

/// Finite numbers from a list, or a list of lists row by row, as OpenCV and ROS write matrices. `key` is for the
/// message.
/// @throws std::invalid_argument when it is no list or does not hold `count` of them.
std::vector<double> numbersFromYaml(const YAML::Node& node, const std::string& key, std::size_t count);

}  // namespace xray_registration
