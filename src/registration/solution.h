#pragma once

#include <algorithm>

#include "xray_registration/registration/gauss_newton.h"

namespace xray_registration {

/// No robustness: a scale on 1 − correlation that no window reaches.
constexpr double kNotRobust = 1e6;

/// Where a coarse-to-fine descent stands.
struct Solution : GaussNewtonResult {
  double robust_scale2 = kNotRobust;  ///< That the objective was made with; for whoever goes on from here.
  double coarser_similarity = -1.0;   ///< At the end of the stage before.

  /// The similarity of this stage or of the one before, whichever is larger: noise hides it on finer levels.
  double likeness() const { return std::max(sums.similarity, coarser_similarity); }
};

/// What a cold start found out about a session, for the frames that are tracked from it.
struct ColdStart {
  int coarsest_level = 0;             ///< Of the X-ray's pyramid, on which the CT still has a shadow of some size.
  double robust_scale2 = kNotRobust;  ///< Of the windows' errors on the finest level.
  bool leave_out_unexplained = true;  ///< Whether rays behind cut faces are left out (the body goes on).
  double similarity = 1.0;            ///< Of what was found, as the verdict saw it.
  double inlier_fraction = 1.0;
  int levels_to_spare = 0;  ///< That tracked frames need not go down to: levelsToSpare.
};

}  // namespace xray_registration
