#pragma once

#include "registration/setup_objective.h"

namespace xray_registration {

/// What is left to move in the images when the pose is right: a smooth field of shifts over each view, as far as no
/// motion of the pose imitates it. Another patient's CT, one that was bent, and wrong geometry leave it; noise and what
/// hides the CT here and there do not move many windows alike.
struct ResidualField {
  bool determined = false;  ///< The views fix the pose; without it the rest means nothing.
  double rms_mm = 0.0;      ///< At the CT's depth, over what the windows see, less what chance gives.
  double sigma_mm = 0.0;    ///< Of rms_mm.
  double deviations = 0.0;  ///< How many σ the evidence for a field lies above what chance gives.
  double gain = 0.0;        ///< rᵀS⁻¹r, which ScoreTest::gain of a single cause compares with.
};

/// A score test of the field's coefficients, the pose free to follow (score_test.h): with r their score, S its
/// curvature and B its scatter, rᵀS⁻¹r has mean tr(S⁻¹B) and variance 2 tr((S⁻¹B)²) when nothing is left. Compared with
/// the curvature by a shift of everything it is a mean square of shifts. `evidence`: of windows that do not overlap.
ResidualField residualField(const SetupEvidence& evidence);

}  // namespace xray_registration
