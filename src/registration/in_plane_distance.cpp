#include "registration/in_plane_distance.h"

#include "registration/frame_objective.h"

namespace xray_registration {

double inPlaneDistance(const RigidTransform& a, const RigidTransform& b, const Eigen::Vector3d& centre_ct) {
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d target = centre_ct + side * kTargetRadiusMm * Eigen::Vector3d::Unit(axis);
      sum += (a * target - b * target).head<2>().norm();
    }
  }
  return sum / 6.0;
}

}  // namespace xray_registration
