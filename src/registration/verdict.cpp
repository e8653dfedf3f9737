#include "xray_registration/registration/verdict.h"

#include <algorithm>

#include "registration/sentence.h"
#include "xray_registration/geometry/angles.h"

namespace xray_registration {
namespace {

/// How much less alike than its cold start a tracked frame may be where that was not alike itself.
constexpr double kMayFall = 0.1;

struct Likeness {
  double similarity = 0.0;
  double inlier_fraction = 0.0;
};

/// What a result needs: less where it was compared with other places, or follows one that was.
Likeness leastLikeness(const VerdictCues& cues, const AcceptOptions& accept) {
  const Likeness least{accept.min_similarity, accept.min_inlier_fraction};
  if (cues.has_second_solve) return least;
  const Likeness alone{std::max(least.similarity, accept.alone_similarity),
                       std::max(least.inlier_fraction, accept.alone_inlier_fraction)};
  if (!cues.tracking) return alone;
  return {std::clamp(cues.found_similarity - kMayFall, least.similarity, alone.similarity),
          std::clamp(cues.found_inlier_fraction - kMayFall, least.inlier_fraction, alone.inlier_fraction)};
}

}  // namespace

AcceptOptions thresholdsFor(std::size_t views, AcceptOptions accept) {
  if (views > 1) return accept;
  accept.min_similarity = std::max(accept.min_similarity, accept.min_similarity_one_view);
  accept.min_inlier_fraction = std::max(accept.min_inlier_fraction, accept.min_inlier_fraction_one_view);
  accept.alone_similarity = std::max(accept.alone_similarity, accept.alone_similarity_one_view);
  accept.alone_inlier_fraction = std::max(accept.alone_inlier_fraction, accept.alone_inlier_fraction_one_view);
  return accept;
}

bool standsAlone(double similarity, double inlier_fraction, const AcceptOptions& accept) {
  return similarity >= std::max(accept.min_similarity, accept.alone_similarity) &&
         inlier_fraction >= std::max(accept.min_inlier_fraction, accept.alone_inlier_fraction);
}

std::string reasonToRefuse(const VerdictCues& cues, const AcceptOptions& accept) {
  if (!cues.finite) return "the solver met a number that is not finite";
  if (!cues.in_view) return "the CT left the image";
  if (cues.exceeded_steps > 0) {
    return sentence("the solver ran out of its ", cues.exceeded_steps,
                    " steps a frame (solver/max_steps_per_frame) before it was done");
  }
  const Likeness least = leastLikeness(cues, accept);
  if (!(cues.similarity >= least.similarity)) {
    return sentence("the X-ray and the DRR do not look alike: similarity ", cues.similarity, " is below ",
                    least.similarity);
  }
  if (!(cues.inlier_fraction >= least.inlier_fraction)) {
    return sentence("too little of the X-ray is explained by the CT: inlier fraction ", cues.inlier_fraction,
                    " is below ", least.inlier_fraction);
  }
  if (!(cues.condition_number <= accept.max_condition_number)) {
    return sentence("the image does not fix the pose: condition number ", cues.condition_number, " is above ",
                    accept.max_condition_number);
  }
  if (!cues.converged) return "the solver stopped before it converged";
  if (cues.search_range_mm > 0.0 && !(cues.jump_mm <= cues.search_range_mm)) {
    return sentence("the pose moved ", cues.jump_mm, " mm from the start, outside the range of ", cues.search_range_mm,
                    " mm that is searched");
  }
  if (cues.search_range_rad > 0.0 && !(cues.jump_rad <= cues.search_range_rad)) {
    return sentence("the pose turned ", cues.jump_rad * kDegreesPerRadian,
                    " degrees from the start, outside the range of ", cues.search_range_rad * kDegreesPerRadian,
                    " that is searched");
  }
  if (cues.tracking && !(cues.jump_mm <= accept.max_jump_mm)) {
    return sentence("the pose jumped ", cues.jump_mm, " mm from the prediction, more than ", accept.max_jump_mm);
  }
  if (cues.tracking && !(cues.jump_rad <= accept.max_jump_rad)) {
    return sentence("the pose turned ", cues.jump_rad * kDegreesPerRadian, " degrees from the prediction, more than ",
                    accept.max_jump_rad * kDegreesPerRadian);
  }
  const double margin = cues.similarity - cues.rival_similarity;
  if (cues.has_second_solve && !(margin >= accept.min_margin)) {
    return sentence("another place, ", cues.rival_mm, " mm away, explains the X-ray nearly as well: similarity ",
                    cues.rival_similarity, " against ", cues.similarity);
  }
  const bool clear = cues.rival_similarity > -1.0 && margin >= accept.clear_margin &&
                     standsAlone(cues.similarity, cues.inlier_fraction, accept);
  if (cues.has_second_solve && !clear && !(cues.disagreement_mm <= accept.max_disagreement_mm)) {
    return sentence("a second solve from another start ended ", cues.disagreement_mm, " mm away, more than ",
                    accept.max_disagreement_mm);
  }
  return {};
}

}  // namespace xray_registration
