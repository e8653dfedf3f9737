#pragma once

#include <array>

#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/xray_camera.h"

namespace xray_registration {

/// Of one evaluation: what a tile's vectors leave room for on a device.
constexpr int kMostRayMotions = 20;

/// How one parameter of the set-up moves the straight rays of all pixels through the CT, per unit of the parameter. A
/// ray is the source (the camera's origin) and a direction (x, y, 1), both in camera axes as the CT sees them:
///   d source = source,  d direction = direction (x, y, 1) + r² radial (x, y, 0) + r² swirl (−y, x, 0),  r² = x² + y².
/// The march's sums give the exact derivative of a line integral for any such motion.
struct RayMotion {
  Eigen::Vector3d source = Eigen::Vector3d::Zero();     ///< mm per unit.
  Eigen::Matrix3d direction = Eigen::Matrix3d::Zero();  ///< Per unit.
  double radial = 0.0;                                  ///< Per unit.
  double swirl = 0.0;                                   ///< Per unit.
  bool of_camera = false;  ///< The ray itself changes, not the CT's place on it: its length in mm changes as well.
};

/// Component of the twist [v mm; ω rad] of the CT about a point (rigid_transform.h, updatedPose).
RayMotion motionByTwist(int component, const Eigen::Vector3d& centre_camera_mm);

/// Both focal lengths by a factor exp(parameter).
RayMotion motionByFocalLength();

/// The principal point by one pixel of `camera`, along columns (0) or rows (1).
RayMotion motionByPrincipalPoint(int axis, const XrayCamera& camera);

/// Radial distortion that CameraInfo does not say: the ray of a pixel is that of (x, y)(1 + k r²).
RayMotion motionByRadialDistortion();

/// The S-shaped distortion of an image intensifier (the earth's field turns the image more, the further out): the ray
/// of a pixel is that of (x, y) turned by s r².
RayMotion motionBySwirl();

/// The CT by the symmetric strain I + parameter · strain_ct about a point, in CT axes.
RayMotion motionByStrain(const Eigen::Matrix3d& strain_ct, const RigidTransform& T_camera_ct,
                         const Eigen::Vector3d& centre_camera_mm);

}  // namespace xray_registration
