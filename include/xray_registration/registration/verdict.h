#pragma once

#include <string>

#include "xray_registration/registration/registrar_options.h"

namespace xray_registration {

/// What is known about a solution when it is judged.
struct VerdictCues {
  bool finite = true;      ///< Pose and sums hold no NaN.
  bool in_view = true;     ///< The CT's centre projects near the image and lies in front of the source.
  int exceeded_steps = 0;  ///< The step budget that was used up before the solver was done; 0: it was enough.
  bool converged = false;
  double similarity = 0.0;
  double inlier_fraction = 1.0;
  double condition_number = 1.0;
  bool tracking = false;  ///< The start came from an accepted neighbour, so the jump means something.
  double jump_mm = 0.0;   ///< CT centre, from the start.
  double jump_rad = 0.0;
  double search_range_mm = 0.0;  ///< Cold starts: further from the start than this is outside the search; 0: no bound.
  double search_range_rad = 0.0;
  bool has_second_solve = false;
  double disagreement_mm = 0.0;    ///< Between the solves, in-plane, over the CT's box.
  double rival_similarity = -1.0;  ///< Of the best that was found at another place; −1: nothing was.
  double rival_mm = 0.0;           ///< How far away, in-plane.
  double found_similarity = 1.0;   ///< Of the cold start that a tracked frame follows.
  double found_inlier_fraction = 1.0;
};

/// Whether a result is alike enough to need no comparison with other places, as far as the least goes.
bool standsAlone(double similarity, double inlier_fraction, const AcceptOptions& accept);

/// The thresholds for so many views: one has more look-alikes than several.
AcceptOptions thresholdsFor(std::size_t views, AcceptOptions accept);

/// Why the solution is not to be trusted, in plain words with the numbers; empty when every cue passes.
std::string reasonToRefuse(const VerdictCues& cues, const AcceptOptions& accept);

}  // namespace xray_registration
