#pragma once

#include <vector>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// 5×5×5 grid in a cube of side `target_size_mm` around `centre_ct_mm`.
std::vector<Eigen::Vector3d> targetGrid(const Eigen::Vector3d& centre_ct_mm, double target_size_mm);

struct PoseError {
  double mtre_mm = 0.0;     ///< Mean distance between targets under both poses.
  double inplane_mm = 0.0;  ///< The same of each difference's x and y components in the camera frame.
};

PoseError poseError(const RigidTransform& T_camera_ct_found, const RigidTransform& T_camera_ct_true,
                    const std::vector<Eigen::Vector3d>& targets_ct_mm);

}  // namespace xray_registration
