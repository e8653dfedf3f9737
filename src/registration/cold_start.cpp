#include "registration/cold_start.h"

#include <algorithm>
#include <limits>

#include "registration/pose_search.h"

namespace xray_registration {
namespace {

/// Steps of the search's refinement, of a coarse stage, of the finest.
constexpr int kSearchSteps = 10;
constexpr int kCoarseSteps = 15;
constexpr int kFinestSteps = 8;

/// Mean motion of points on the target sphere between two poses, in the camera's x and y.
double inPlaneDistance(const RigidTransform& a, const RigidTransform& b, const Eigen::Vector3d& centre_ct) {
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d target = centre_ct + side * kTargetRadiusMm * Eigen::Vector3d::Unit(axis);
      sum += (a * target - b * target).head<2>().norm();
    }
  }
  return sum / 6.0;
}

/// Coarse to fine. The search has already been on the coarsest level.
std::vector<Stage> stagesFrom(int coarsest, const RegistrarOptions& options) {
  const int first = options.search && coarsest > 1 ? coarsest - 1 : coarsest;
  std::vector<Stage> stages;
  for (int level = first; level >= 0; --level) {
    stages.push_back(stageOn(level, level == 0 ? kFinestSteps : kCoarseSteps, options.similarity));
  }
  return stages;
}

/// Goes through the stages from `start`; the weights are set, and renewed from each stage to the next.
Solution descend(FrameObjective* objective, const std::vector<Stage>& stages, bool leave_out, const Solution& start) {
  Solution solution = start;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    if (i > 0 && leave_out) objective->views().weigh(true, solution.T_camera_ct);
    if (i > 0) solution.robust_scale2 = objective->robustScale(stages[i - 1], solution.T_camera_ct);
    const double coarser_similarity = solution.sums.similarity;
    if (!objective->solve(stages[i], &solution)) break;
    solution.coarser_similarity = coarser_similarity;
    if (solution.failed) break;
  }
  return solution;
}

/// One search and the descent to the level above the finest. `noticed`: leaving rays out changed weights.
Attempt attemptFrom(FrameObjective* objective, int coarsest, bool leave_out, const RigidTransform& start,
                    int first_index, bool* noticed) {
  const RegistrarOptions& options = objective->options();
  *noticed = objective->views().weigh(leave_out, start);
  Solution found;
  found.T_camera_ct = start;
  if (options.search) {
    const Stage stage{coarsest, coarseSpan(options.similarity), kSearchSteps};
    found.T_camera_ct = searchAround(objective, stage, start, first_index);
    if (leave_out) *noticed |= objective->views().weigh(true, found.T_camera_ct);
  }
  std::vector<Stage> stages = stagesFrom(coarsest, options);
  if (stages.size() > 1) stages.pop_back();
  return {descend(objective, stages, leave_out, found), leave_out};
}

/// Whether the X-ray shows the cut as the CT does (a specimen, a phantom) or a body that goes on is not known before:
/// both are tried, what matches better tells, and goes on to the finest level.
Attempt searchAndDescend(FrameObjective* objective, int coarsest, const RigidTransform& start, int first_index) {
  const RegistrarOptions& options = objective->options();
  bool noticed = false;
  Attempt best = attemptFrom(objective, coarsest, options.truncation_weights, start, first_index, &noticed);
  if (noticed) {
    const Attempt whole = attemptFrom(objective, coarsest, false, start, first_index, &noticed);
    const bool better = best.solution.failed || whole.solution.sums.similarity > best.solution.sums.similarity;
    if (!whole.solution.failed && better) best = whole;
  }
  objective->views().weigh(best.leave_out, best.solution.T_camera_ct);
  const std::vector<Stage> stages = stagesFrom(coarsest, options);
  if (stages.size() > 1 && !best.solution.failed) {
    best.solution.robust_scale2 = objective->robustScale(stages[stages.size() - 2], best.solution.T_camera_ct);
    best.solution = descend(objective, {stages.back()}, best.leave_out, best.solution);
  }
  return best;
}

}  // namespace

std::size_t Attempts::bestIndex() const {
  std::size_t best = 0;
  for (std::size_t i = 1; i < all_.size(); ++i) {
    const Solution& candidate = all_[i].solution;
    const Solution& present = all_[best].solution;
    if (!candidate.failed && (present.failed || candidate.likeness() > present.likeness())) best = i;
  }
  return best;
}

const Attempt& Attempts::best() const { return all_[bestIndex()]; }

double Attempts::disagreementMm() const {
  double nearest = std::numeric_limits<double>::max();
  const std::size_t best = bestIndex();
  if (all_[best].solution.failed) return nearest;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    if (i == best || all_[i].solution.failed) continue;
    nearest =
        std::min(nearest, inPlaneDistance(all_[best].solution.T_camera_ct, all_[i].solution.T_camera_ct, centre_ct_));
  }
  return nearest;
}

ColdStartResult startCold(FrameObjective* objective, const RigidTransform& start) {
  // Other poses around the same start, and a finer level: a right answer is found twice, a wrong one rarely.
  constexpr int kMostAttempts = 4;
  const RegistrarOptions& options = objective->options();
  const int coarsest = objective->views().coarsestLevel(start);
  Attempts attempts(objective->views().centreCt());
  std::optional<double> disagreement_mm;
  for (int i = 0; i < kMostAttempts && !objective->exceeded(); ++i) {
    const int level = i == 0 ? coarsest : std::max(coarsest - 1, 0);
    attempts.add(searchAndDescend(objective, level, start, 1 + i * options.search_poses));
    const Solution& best = attempts.best().solution;
    const bool sure = !best.failed && best.likeness() >= options.accept.sure_similarity;
    disagreement_mm.reset();
    if (!options.search || sure) break;
    disagreement_mm = attempts.disagreementMm();
    if (*disagreement_mm <= options.accept.max_disagreement_mm) break;
  }
  const Attempt& best = attempts.best();
  return {best.solution, {coarsest, best.solution.robust_scale2, best.leave_out}, disagreement_mm};
}

}  // namespace xray_registration
