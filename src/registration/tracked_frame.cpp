#include "registration/tracked_frame.h"

#include <algorithm>

namespace xray_registration {
namespace {

/// Share of the finest level's tiles that are used, and the evaluations there and on the level before.
constexpr double kTiles = 0.4;
constexpr int kFinestSteps = 1;
constexpr int kSteps = 8;
/// A step that is short enough for the finest level to follow it, pixels.
constexpr double kShortPixels = 0.15;

}  // namespace

GaussNewtonOptions TrackedObjective::solverFor(const Stage& stage, const RigidTransform& start) const {
  GaussNewtonOptions solver = FrameObjective::solverFor(stage, start);
  if (stage.level > 0) {
    const double pixel_mm = views().views().front().level(stage.level).camera.pixelSizeAt(solver.depth_mm);
    solver.stop_mm = solver.max_untested_step_mm = kShortPixels * pixel_mm;
  }
  return solver;
}

Solution trackFrame(FrameObjective* objective, const ColdStart& found, const RigidTransform& start) {
  const Similarity similarity = objective->options().similarity;
  DeviceViews& views = objective->views();
  if (found.leave_out_unexplained) views.weigh(true, start);
  Solution solution;
  solution.T_camera_ct = start;
  solution.robust_scale2 = found.robust_scale2;
  // The tracked X-ray may be smaller than the one that the start was found in.
  const bool two_levels = std::min(found.coarsest_level, views.lastLevel()) >= 1;
  if (two_levels) {
    objective->solve(stageOn(1, kSteps, similarity), &solution);
    if (solution.failed) return solution;
    views.keepContrastTiles(kTiles);
  }
  solution.coarser_similarity = solution.sums.similarity;
  objective->solve(stageOn(0, two_levels ? kFinestSteps : kSteps, similarity), &solution);
  // A small bone among others is elsewhere by more than a pixel from level to level.
  if (two_levels && !solution.converged && !solution.failed)
    objective->solve(stageOn(0, kSteps, similarity), &solution);
  return solution;
}

}  // namespace xray_registration
