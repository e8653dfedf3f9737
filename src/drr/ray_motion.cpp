#include "xray_registration/drr/ray_motion.h"

#include "xray_registration/geometry/cross_matrix.h"

namespace xray_registration {

RayMotion motionByTwist(int component, const Eigen::Vector3d& centre_camera_mm) {
  // The CT moves, so as the CT sees it the ray moves the other way.
  RayMotion motion;
  const Eigen::Vector3d axis = Eigen::Vector3d::Unit(component % 3);
  if (component < 3) {
    motion.source = -axis;
  } else {
    motion.source = axis.cross(centre_camera_mm);
    motion.direction = -crossMatrix(axis);
  }
  return motion;
}

RayMotion motionByFocalLength() {
  RayMotion motion;
  motion.direction.diagonal() << -1.0, -1.0, 0.0;
  motion.of_camera = true;
  return motion;
}

RayMotion motionByPrincipalPoint(int axis, const XrayCamera& camera) {
  RayMotion motion;
  motion.direction(axis, 2) = -1.0 / (axis == 0 ? camera.fx : camera.fy);
  motion.of_camera = true;
  return motion;
}

RayMotion motionByRadialDistortion() {
  RayMotion motion;
  motion.radial = 1.0;
  motion.of_camera = true;
  return motion;
}

RayMotion motionBySwirl() {
  RayMotion motion;
  motion.swirl = 1.0;
  motion.of_camera = true;
  return motion;
}

RayMotion motionByStrain(const Eigen::Matrix3d& strain_ct, const RigidTransform& T_camera_ct,
                         const Eigen::Vector3d& centre_camera_mm) {
  const Eigen::Matrix3d strain = T_camera_ct.linear() * strain_ct * T_camera_ct.linear().transpose();
  RayMotion motion;
  motion.source = strain * centre_camera_mm;  // −strain (0 − centre)
  motion.direction = -strain;
  return motion;
}

}  // namespace xray_registration
