#pragma once

#include <Eigen/Core>
#include <vector>

// Smooth maps of the plane into itself, fitted to scattered points. Private to this room.
namespace xray_registration {

/// Where a point of the plane goes.
struct PlaneSample {
  Eigen::Vector2d from;
  Eigen::Vector2d to;
};

/// Two polynomials of two variables: Σ c_k xⁱ yʲ over i + j ≤ degree, with (x, y) = (point − centre) / scale. The terms
/// stand by total degree and, within it, by falling powers of x: 1, x, y, x², xy, y², …
struct PolynomialSurface {
  static constexpr int kHighestDegree = 9;
  /// Number of terms.
  static int termCount(int degree) { return (degree + 1) * (degree + 2) / 2; }

  int degree = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double scale = 1.0;
  Eigen::MatrixX2d coefficients;

  Eigen::Vector2d at(const Eigen::Vector2d& point) const;
  Eigen::Matrix2d jacobianAt(const Eigen::Vector2d& point) const;
};

/// How a surface was fitted.
struct SurfaceFit {
  PolynomialSurface surface;
  std::vector<bool> used;            ///< Per sample; false for those that contradict the others.
  double cross_validated_rms = 0.0;  ///< Of points that a fit to the others predicts.
};

/// Least squares with the smallest degree that predicts held-back points as well as any other; samples far outside the
/// spread of the residuals are left out.
/// @throws std::invalid_argument for fewer than kFewestSamples.
SurfaceFit fitSurface(const std::vector<PlaneSample>& samples);
constexpr std::size_t kFewestSamples = 12;

}  // namespace xray_registration
