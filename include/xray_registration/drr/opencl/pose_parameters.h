#pragma once

#include <array>

#include "xray_registration/drr/opencl/layout.h"
#include "xray_registration/drr/opencl/opencl_volume.h"
#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/xray_camera.h"

namespace xray_registration {

using PoseParameters = std::array<float, layout::kPoseStride>;

/// What the fast method's kernels need to know of a pose: rays in voxel indices and their derivatives by the twist
/// about `centre_camera_mm` (rigid_transform.h, updatedPose), all as linear forms of the pixel, made here in double so
/// that only the last rounding is in float.
PoseParameters poseParameters(const OpenClLevel& level, const XrayCamera& camera, const RigidTransform& T_camera_ct,
                              const Eigen::Vector3d& centre_camera_mm);

/// The same for a CT that is also stretched or mirrored; from the camera to the CT, since that is what is needed.
PoseParameters poseParameters(const OpenClLevel& level, const XrayCamera& camera, const Eigen::Affine3d& T_ct_camera,
                              const Eigen::Vector3d& centre_camera_mm);

}  // namespace xray_registration
