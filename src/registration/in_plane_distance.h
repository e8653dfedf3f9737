#pragma once

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// Mean motion of points on the target sphere between two poses, in the camera's x and y, mm.
double inPlaneDistance(const RigidTransform& a, const RigidTransform& b, const Eigen::Vector3d& centre_ct);

/// Poses further apart, in-plane, are at different places: what refines to one optimum on a coarse level ends nearer.
constexpr double kOtherPlaceMm = 5.0;

}  // namespace xray_registration
