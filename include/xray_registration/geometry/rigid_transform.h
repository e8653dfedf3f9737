#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace xray_registration {

/// A rigid motion x_to = R x_from + t; lengths in millimetres. Variables state both frames, T_<to>_<from>.
using RigidTransform = Eigen::Isometry3d;

/// Small rigid motion [v; ω]: translation in mm first, rotation in rad second (the order of REP-103 covariances).
using Twist = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Rotation by the vector ω (axis times angle, rad): Rodrigues' formula, series near zero.
Eigen::Matrix3d rotationFromVector(const Eigen::Vector3d& rotation_rad);

/// Inverse of rotationFromVector, angle in [0, π].
Eigen::Vector3d vectorFromRotation(const Eigen::Matrix3d& rotation);

/// Pose update of the solver: rotates the object about `centre_camera_mm` in camera axes, then shifts it,
/// T' = Trans(v) Trans(c) Rot(ω) Trans(-c) T. In-plane and depth motion decouple and the normal matrix is well scaled.
RigidTransform updatedPose(const RigidTransform& T_camera_ct, const Twist& twist,
                           const Eigen::Vector3d& centre_camera_mm);

/// The twist that carries T_from to T_to: updatedPose(T_from, twistBetween(...), centre) == T_to.
Twist twistBetween(const RigidTransform& T_from, const RigidTransform& T_to, const Eigen::Vector3d& centre_camera_mm);

/// Carries a twist about `centre_first` in the axes of the first camera into the same motion of the object as seen by
/// another camera with T_other_first, about the same physical point: block-diagonal rotation (v, ω by R_other_first).
Matrix6d twistCarriedBy(const RigidTransform& T_other_first);

/// Carries a twist about one point into the same motion about another that lies `offset_mm` from it, same axes:
/// v' = v + ω × offset.
Matrix6d twistMovedBy(const Eigen::Vector3d& offset_mm);

/// Angle between the rotations of two poses in rad.
double rotationAngleBetween(const RigidTransform& a, const RigidTransform& b);

/// True when every entry is finite and the linear part is a rotation within `tolerance`.
bool isRigid(const Eigen::Matrix4d& matrix, double tolerance = 1e-3);

/// Nearest rigid transform of a matrix that passes isRigid.
/// @throws std::invalid_argument when it does not.
RigidTransform rigidFromMatrix(const Eigen::Matrix4d& matrix);

/// The rotation is normalised; files and messages hold rounded ones.
/// @throws std::invalid_argument when a number is not finite or the rotation's length is more than 1 % off 1.
RigidTransform rigidFromQuaternion(const Eigen::Vector3d& translation_mm, const Eigen::Quaterniond& rotation);

}  // namespace xray_registration
