#pragma once

#include <Eigen/Core>
#include <functional>

#include "xray_registration/drr/ray_motion.h"
#include "xray_registration/drr/similarity.h"
#include "xray_registration/drr/tile_products.h"

namespace xray_registration {

/// What one window of tiles says about the parameters that its tiles' vectors are derivatives by.
struct WindowEvidence {
  int x = 0;  ///< First tile.
  int y = 0;
  double pixels = 0.0;       ///< Σ weight.
  double content = 0.0;      ///< 0 … 1: how much of the DRR's variance is more than flat.
  double importance = 0.0;   ///< Weight of the window in the objective, robustness apart.
  double correlation = 0.0;  ///< Of X-ray and DRR.
  double cost = 0.0;         ///< importance · ρ(1 − correlation)
  /// Of the cost, exact.
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostRayMotions, 1> gradient;
  /// Gauss-Newton.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostRayMotions, kMostRayMotions> matrix;
};

/// A window's covariances of all its vectors (1, DRR, X-ray, derivatives …; those with the 1 are zero), about its
/// means.
using WindowCovariance =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3 + kMostRayMotions, 3 + kMostRayMotions>;

/// The windows of span × span tiles that count, as forEachWindow chooses them: pixels and covariances.
void forEachWindowCovariance(const TileProducts& products, int span,
                             const std::function<void(double pixels, const WindowCovariance& covariance)>& look);

/// The windows that count, from their tiles' sums, in double: what kernels/windows.cl adds up on the device for the six
/// of the pose, here one by one and for any number of parameters. docs/design.md has the formulae.
/// Windows come row by row, and which ones count depends on the X-ray alone.
void forEachWindow(const TileProducts& products, const WindowOptions& options,
                   const std::function<void(const WindowEvidence&)>& look);

}  // namespace xray_registration
