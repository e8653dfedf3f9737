#include "registration/frame_objective.h"

#include <algorithm>
#include <optional>

#include "xray_registration/common/statistics.h"

namespace xray_registration {
namespace {

WindowOptions windowOptions(Similarity similarity, const ResidentXray& xray, const Stage& stage, double robust_scale2) {
  WindowOptions window = windowsFor(similarity, xray.deviation());
  window.span = stage.span;
  window.robust_scale2 = robust_scale2;
  return window;
}

/// Adds a view's sums: the same motion in this camera's axes, so the normal equations come back by the transpose.
/// Similarity and inlier fraction are summed with the content as weight.
void addView(const StepSums& sums, const Matrix6d& twist_carried, StepSums* total) {
  total->matrix += twist_carried.transpose() * sums.matrix * twist_carried;
  total->gradient += twist_carried.transpose() * sums.gradient;
  total->scatter += twist_carried.transpose() * sums.scatter * twist_carried;
  total->cost += sums.cost;
  total->weight += sums.weight;
  total->similarity += sums.similarity * sums.content;
  total->inlier_fraction += sums.inlier_fraction * sums.content;
  total->content += sums.content;
}

}  // namespace

std::vector<StepSums> FrameObjective::evaluateView(const DeviceViews::View& view, const Stage& stage,
                                                   double robust_scale2,
                                                   const std::vector<RigidTransform>& T_camera_ct) {
  std::vector<RigidTransform> T_view_ct;
  T_view_ct.reserve(T_camera_ct.size());
  for (const RigidTransform& pose : T_camera_ct) T_view_ct.push_back(view.T_view_first * pose);
  views_->drawSurroundings(view, stage.level);
  return engine_->evaluate(view.xray.get(), stage.level,
                           views_->volumeLevel(view.level(stage.level).camera, T_view_ct.front()), T_view_ct,
                           windowOptions(options_.similarity, *view.xray, stage, robust_scale2));
}

std::vector<StepSums> FrameObjective::evaluate(const Stage& stage, double robust_scale2,
                                               const std::vector<RigidTransform>& T_camera_ct) {
  if (!budget_->draw()) return {};
  std::vector<StepSums> totals(T_camera_ct.size());
  for (const DeviceViews::View& view : views_->views()) {
    const std::vector<StepSums> sums = evaluateView(view, stage, robust_scale2, T_camera_ct);
    for (std::size_t i = 0; i < totals.size(); ++i) addView(sums[i], view.twist_carried, &totals[i]);
  }
  for (StepSums& total : totals) {
    if (!(total.content > 0.0)) continue;
    total.similarity /= total.content;
    total.inlier_fraction /= total.content;
  }
  return totals;
}

GaussNewtonOptions FrameObjective::solverFor(const Stage& stage, const RigidTransform& start) const {
  const double depth_mm = views_->depthOf(start);
  const double pixel_mm = views_->views().front().level(stage.level).camera.pixelSizeAt(depth_mm);
  GaussNewtonOptions solver;
  solver.max_steps = stage.max_steps;
  solver.radius_mm = kTargetRadiusMm;
  solver.depth_mm = depth_mm;
  // The last step of the finest level is taken untested, so it may be longer than what counts.
  solver.stop_mm = (stage.level == 0 ? 0.1 : 0.05) * pixel_mm;
  solver.max_untested_step_mm = stage.level == 0 ? 0.3 * pixel_mm : 0.0;
  return solver;
}

bool FrameObjective::solve(const Stage& stage, Solution* solution) {
  const auto objective = [&](const RigidTransform& pose) -> std::optional<StepSums> {
    const std::vector<StepSums> sums = evaluate(stage, solution->robust_scale2, {pose});
    if (sums.empty()) return std::nullopt;
    return sums.front();
  };
  const RigidTransform start = solution->T_camera_ct;
  const GaussNewtonResult end = minimise(objective, start, views_->centreCt(), solverFor(stage, start));
  if (end.steps == 0) {
    solution->converged = false;
    return false;
  }
  static_cast<GaussNewtonResult&>(*solution) = end;
  return true;
}

std::vector<float> FrameObjective::correlations(const Stage& stage, const RigidTransform& T_camera_ct) {
  if (!budget_->draw()) return {};
  std::vector<float> all;
  for (const DeviceViews::View& view : views_->views()) {
    evaluateView(view, stage, kNotRobust, {T_camera_ct});
    for (const float correlation : engine_->windowCorrelations()) {
      if (correlation >= -1.0F) all.push_back(correlation);
    }
  }
  return all;
}

double FrameObjective::robustScale(const Stage& stage, const RigidTransform& T_camera_ct) {
  if (!options_.robust_weights || stage.span == 0) return kNotRobust;
  std::vector<float> errors = correlations(stage, T_camera_ct);
  if (errors.empty()) return kNotRobust;
  for (float& error : errors) error = 1.0F - error;
  // At three times the median a window keeps a quarter of its weight.
  return std::max(0.1, 3.0 * static_cast<double>(valueOfRank(&errors, errors.size() / 2)));
}

}  // namespace xray_registration
