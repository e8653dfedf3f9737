#pragma once

#include <Eigen/Core>

namespace xray_registration {

/// The matrix of a cross product: crossMatrix(a) b = a × b.
inline Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& a) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return matrix;
}

}  // namespace xray_registration
