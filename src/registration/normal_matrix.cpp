#include "registration/normal_matrix.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace xray_registration {

Matrix6d scaledToRadius(const Matrix6d& matrix, double radius_mm) {
  Twist scale = Twist::Ones();
  scale.tail<3>() /= radius_mm;
  return scale.asDiagonal() * matrix * scale.asDiagonal();
}

double conditionNumber(const Matrix6d& normal, double radius_mm) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scaledToRadius(normal, radius_mm), Eigen::EigenvaluesOnly);
  const double smallest = eigen.eigenvalues()[0];
  return smallest > 0.0 ? std::min(eigen.eigenvalues()[5] / smallest, 1e30) : 1e30;
}

}  // namespace xray_registration
