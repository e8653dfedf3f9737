#include "xray_registration/geometry/joint_angles.h"

#include <cmath>

namespace xray_registration {
namespace {

// The cosine of y below which rounding of single precision files (1e-7) decides x and z.
constexpr double kLockedCosine = 1e-6;

}  // namespace

CardanAngles cardanAngles(const Eigen::Matrix3d& R_reference_body) {
  const Eigen::Matrix3d& r = R_reference_body;
  CardanAngles angles;
  // The cosine from both entries that hold it: asin of a sine near 1 would lose half of the digits.
  const double cosine = std::hypot(r(0, 0), r(0, 1));
  angles.y_rad = std::atan2(r(0, 2), cosine);
  angles.is_locked = cosine < kLockedCosine;
  if (angles.is_locked) {
    angles.x_rad = std::atan2(r(2, 1), r(1, 1));
    return angles;
  }
  angles.x_rad = std::atan2(-r(1, 2), r(2, 2));
  angles.z_rad = std::atan2(-r(0, 1), r(0, 0));
  return angles;
}

KneeMotion kneeMotion(const RigidTransform& T_femur_tibia, Side side) {
  // e1, e2, e3 are the axes of the Cardan sequence x, y', z''.
  const CardanAngles angles = cardanAngles(T_femur_tibia.linear());
  // On the left, x points to the other leg, so turns about y and z and shifts along x change their clinical sense.
  const double sign = side == Side::kRight ? 1.0 : -1.0;
  const Eigen::Vector3d e1 = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d e2 = Eigen::AngleAxisd(angles.x_rad, e1) * Eigen::Vector3d::UnitY();
  const Eigen::Vector3d e3 = T_femur_tibia.linear().col(2);
  const Eigen::Vector3d tibia = T_femur_tibia.translation();
  KneeMotion motion;
  motion.flexion_rad = -angles.x_rad;
  motion.adduction_rad = sign * angles.y_rad;
  motion.internal_rotation_rad = sign * angles.z_rad;
  motion.lateral_mm = sign * tibia.dot(e1);
  motion.anterior_mm = tibia.dot(e2);
  motion.distraction_mm = -tibia.dot(e3);
  motion.is_locked = angles.is_locked;
  return motion;
}

RigidTransform anatomyInCt(const Eigen::Vector3d& origin_ct_mm) {
  RigidTransform T_ct_anatomy = RigidTransform::Identity();
  T_ct_anatomy.linear() = Eigen::Vector3d(-1.0, -1.0, 1.0).asDiagonal();
  T_ct_anatomy.translation() = origin_ct_mm;
  return T_ct_anatomy;
}

RigidTransform jointPose(const RigidTransform& T_camera_reference, const RigidTransform& T_camera_body,
                         const RigidTransform& T_reference_anatomy, const RigidTransform& T_body_anatomy) {
  return (T_camera_reference * T_reference_anatomy).inverse() * (T_camera_body * T_body_anatomy);
}

}  // namespace xray_registration
