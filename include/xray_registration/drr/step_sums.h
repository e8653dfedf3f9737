#pragma once

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// One evaluation of the objective E(ξ) = Σ windows importance · ρ(1 − correlation) at ξ = 0: value, exact gradient,
/// Gauss-Newton matrix. The twist is about the CT's centre, in the view's camera axes.
struct StepSums {
  Matrix6d matrix = Matrix6d::Zero();
  Twist gradient = Twist::Zero();
  Matrix6d scatter = Matrix6d::Zero();  ///< Σ of the windows' gradients' outer products.
  double cost = 0.0;
  double weight = 0.0;           ///< Σ importance: cost / weight is a mean in 0 … 2.
  double similarity = 0.0;       ///< Mean correlation over windows with CT content.
  double inlier_fraction = 0.0;  ///< Share of that content in windows that correlate well enough to show the CT.
  double content = 0.0;          ///< Pixels with CT content.
  bool finite() const;
};

}  // namespace xray_registration
