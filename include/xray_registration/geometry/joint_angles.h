#pragma once

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// Rotation as three turns about the axes of a moving frame, first x, then the turned y, then the twice turned z:
/// R = Rx(x) Ry(y) Rz(z). y lies within ±π/2, the others within ±π.
struct CardanAngles {
  double x_rad = 0.0;
  double y_rad = 0.0;
  double z_rad = 0.0;
  /// y is ±π/2 to rounding: x and z turn about the same line, only their sum or difference is known, and z is told as
  /// 0.
  bool is_locked = false;
};

/// Of a body against a reference frame. In the frames of a CT (LPS) x is flexion and extension, y is lateral bending,
/// z is axial rotation.
CardanAngles cardanAngles(const Eigen::Matrix3d& R_reference_body);

enum class Side { kRight, kLeft };

/// How a knee's tibia stands against its femur, in the joint coordinate system of Grood and Suntay, "A joint coordinate
/// system for the clinical description of three-dimensional motions: application to the knee", J Biomech Eng 105, 1983:
/// e1 is fixed to the femur (x), e3 to the tibia (z), e2 = e3 × e1 floats. Angles in rad, lengths in mm. The signs are
/// the clinical ones on both sides.
struct KneeMotion {
  double flexion_rad = 0.0;            ///< About e1; the shank moves backwards.
  double adduction_rad = 0.0;          ///< About e2 (varus); the foot moves towards the other leg.
  double internal_rotation_rad = 0.0;  ///< About e3; the toes turn towards the other leg.
  double lateral_mm = 0.0;             ///< The tibia's origin along e1, away from the other leg.
  double anterior_mm = 0.0;            ///< … along e2, forwards.
  double distraction_mm = 0.0;         ///< … against e3, away from the femur.
  bool is_locked = false;              ///< Adduction is ±π/2: no telling flexion from rotation.
};

/// From the tibia's pose in the femur, both in anatomical frames: x to the patient's right (on both sides), y to the
/// front, z towards the hip.
KneeMotion kneeMotion(const RigidTransform& T_femur_tibia, Side side);

/// The anatomical frame of kneeMotion in a CT's frame (LPS: x left, y back, z up), with its origin at `origin_ct_mm`:
/// half a turn about z.
RigidTransform anatomyInCt(const Eigen::Vector3d& origin_ct_mm = Eigen::Vector3d::Zero());

/// The pose of one body's anatomical frame in that of another, from both poses in a camera and where the anatomical
/// frames lie in the bodies' own.
RigidTransform jointPose(const RigidTransform& T_camera_reference, const RigidTransform& T_camera_body,
                         const RigidTransform& T_reference_anatomy = RigidTransform::Identity(),
                         const RigidTransform& T_body_anatomy = RigidTransform::Identity());

}  // namespace xray_registration
