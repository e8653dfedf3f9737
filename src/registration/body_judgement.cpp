#include "registration/body_judgement.h"

#include "registration/judgement.h"
#include "registration/normal_matrix.h"
#include "registration/sentence.h"
#include "xray_registration/geometry/angles.h"

namespace xray_registration {
namespace {

/// Share of the similarity of all views together that each has to have: with one of two views only, a body may lie
/// anywhere along that one's rays. (Spine session: right places have 0.43 and more, wrong ones 0.34 and less.)
constexpr double kEachView = 0.8;

std::string reasonToRefuse(const DeviceViews& views, const BodyModel& model, const BodyCues& cues,
                           const RegistrarOptions& options, const BodyResult& result) {
  if (!cues.solution.sums.finite() || !cues.solution.T_camera_ct.matrix().allFinite()) {
    return "the solver met a number that is not finite";
  }
  const BodyAcceptOptions& accept = options.accept.body;
  const Eigen::Vector3d centre_camera_mm = cues.solution.T_camera_ct * views.centreCt();
  const double moved_mm = (centre_camera_mm - cues.T_camera_ct * views.centreCt()).norm();
  const double turned_rad = rotationAngleBetween(cues.solution.T_camera_ct, cues.T_camera_ct);
  if (!views.seesCentre(cues.solution.T_camera_ct)) return model.name + " left the image";
  if (cues.exceeded_steps > 0) return sentence("the solver ran out of its ", cues.exceeded_steps, " steps");
  if (!(moved_mm <= model.max_translation_mm)) {
    return sentence(model.name, " moved ", moved_mm, " mm from where the CT has it, more than ",
                    model.max_translation_mm, " (max_translation)");
  }
  if (!(turned_rad <= model.max_rotation_rad)) {
    return sentence(model.name, " turned ", turned_rad * kDegreesPerRadian,
                    " degrees from where the CT has it, more than ", model.max_rotation_rad * kDegreesPerRadian,
                    " (max_rotation)");
  }
  if (!(result.similarity >= accept.min_similarity)) {
    return sentence("the X-rays do not show ", model.name, " there: similarity ", result.similarity, " is below ",
                    accept.min_similarity);
  }
  const double least = kEachView * accept.min_similarity;
  for (const double similarity : cues.views) {
    if (similarity >= least) continue;
    return sentence("one of the views does not show ", model.name, " there: its similarity ", similarity, " is below ",
                    least);
  }
  if (!(result.inlier_fraction >= accept.min_inlier_fraction)) {
    return sentence("too little of ", model.name, " is seen: inlier fraction ", result.inlier_fraction, " is below ",
                    accept.min_inlier_fraction);
  }
  if (!(result.similarity - cues.rival.similarity >= accept.min_margin)) {
    return sentence("another place for ", model.name, ", ", cues.rival.distance_mm,
                    " mm away, explains the X-rays nearly as well: similarity ", cues.rival.similarity, " against ",
                    result.similarity);
  }
  if (cues.solution.failed || !cues.solution.converged) return "the solver stopped before it converged";
  return {};
}

}  // namespace

void refuseOverlaps(const Eigen::MatrixXd& overlaps_mm3, const BodyAcceptOptions& accept,
                    std::vector<BodyResult>* results) {
  const std::vector<BodyResult> before = *results;
  for (std::size_t i = 0; i < before.size(); ++i) {
    for (std::size_t j = 0; j < before.size(); ++j) {
      const double overlap_mm3 = overlaps_mm3(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      if (i == j || !before[i].accepted || !before[j].accepted || overlap_mm3 <= accept.max_overlap_mm3) continue;
      BodyResult& refused = (*results)[i];
      refused.accepted = false;
      refused.reason = sentence(refused.name, " and ", before[j].name, " lie in one place: ", overlap_mm3,
                                " mm³ of bone in both, more than ", accept.max_overlap_mm3);
    }
  }
}

BodyResult judgeBody(const DeviceViews& views, const BodyModel& model, const BodyCues& cues,
                     const RegistrarOptions& options) {
  BodyResult result;
  result.name = model.name;
  result.solved = true;
  result.T_camera_body = cues.solution.T_camera_ct;
  result.similarity = cues.solution.sums.similarity;
  result.inlier_fraction = cues.solution.sums.inlier_fraction;
  result.centre_ct_mm = views.centreCt();
  result.covariance = covarianceOf(cues.solution.sums, 1);
  result.reason = reasonToRefuse(views, model, cues, options, result);
  result.accepted = result.reason.empty();
  return result;
}

}  // namespace xray_registration
