#include "xray_registration/geometry/rigid_transform.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "xray_registration/geometry/cross_matrix.h"

namespace xray_registration {

Eigen::Matrix3d rotationFromVector(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  if (angle < 1e-12) {
    Eigen::Matrix3d small = Eigen::Matrix3d::Identity();
    small(0, 1) = -rotation_rad.z();
    small(0, 2) = rotation_rad.y();
    small(1, 0) = rotation_rad.z();
    small(1, 2) = -rotation_rad.x();
    small(2, 0) = -rotation_rad.y();
    small(2, 1) = rotation_rad.x();
    return small;
  }
  return Eigen::AngleAxisd(angle, rotation_rad / angle).toRotationMatrix();
}

Eigen::Vector3d vectorFromRotation(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

RigidTransform updatedPose(const RigidTransform& T_camera_ct, const Twist& twist,
                           const Eigen::Vector3d& centre_camera_mm) {
  const Eigen::Matrix3d rotation = rotationFromVector(twist.tail<3>());
  RigidTransform updated = RigidTransform::Identity();
  updated.linear() = rotation * T_camera_ct.linear();
  updated.translation() =
      rotation * (T_camera_ct.translation() - centre_camera_mm) + centre_camera_mm + twist.head<3>();
  // Products of many updates drift off the rotations; one quaternion normalisation keeps them there.
  updated.linear() = Eigen::Quaterniond(updated.linear()).normalized().toRotationMatrix();
  return updated;
}

Twist twistBetween(const RigidTransform& T_from, const RigidTransform& T_to, const Eigen::Vector3d& centre_camera_mm) {
  const Eigen::Matrix3d rotation = T_to.linear() * T_from.linear().transpose();
  Twist twist;
  twist.tail<3>() = vectorFromRotation(rotation);
  twist.head<3>() = T_to.translation() - centre_camera_mm - rotation * (T_from.translation() - centre_camera_mm);
  return twist;
}

Matrix6d twistCarriedBy(const RigidTransform& T_other_first) {
  Matrix6d carried = Matrix6d::Zero();
  carried.topLeftCorner<3, 3>() = T_other_first.linear();
  carried.bottomRightCorner<3, 3>() = T_other_first.linear();
  return carried;
}

Matrix6d twistMovedBy(const Eigen::Vector3d& offset_mm) {
  Matrix6d carried = Matrix6d::Identity();
  carried.topRightCorner<3, 3>() = -crossMatrix(offset_mm);
  return carried;
}

double rotationAngleBetween(const RigidTransform& a, const RigidTransform& b) {
  return Eigen::Quaterniond(a.linear()).angularDistance(Eigen::Quaterniond(b.linear()));
}

bool isRigid(const Eigen::Matrix4d& matrix, double tolerance) {
  if (!matrix.allFinite()) return false;
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  const bool orthonormal =
      (linear * linear.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < tolerance;
  const bool last_row = (matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < tolerance;
  return orthonormal && last_row && linear.determinant() > 0.0;
}

RigidTransform rigidFromMatrix(const Eigen::Matrix4d& matrix) {
  if (!isRigid(matrix)) throw std::invalid_argument("the matrix is not a rigid transform");
  RigidTransform transform = RigidTransform::Identity();
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  transform.linear() = Eigen::Quaterniond(linear).normalized().toRotationMatrix();
  transform.translation() = matrix.topRightCorner<3, 1>();
  return transform;
}

RigidTransform rigidFromQuaternion(const Eigen::Vector3d& translation_mm, const Eigen::Quaterniond& rotation) {
  if (!translation_mm.allFinite() || !rotation.coeffs().allFinite()) {
    throw std::invalid_argument("has a number that is not finite");
  }
  if (std::abs(rotation.norm() - 1.0) > 0.01) {
    throw std::invalid_argument("has an orientation of length " + std::to_string(rotation.norm()) +
                                "; a quaternion of length 1 is needed");
  }
  RigidTransform transform = RigidTransform::Identity();
  transform.linear() = rotation.normalized().toRotationMatrix();
  transform.translation() = translation_mm;
  return transform;
}

}  // namespace xray_registration
