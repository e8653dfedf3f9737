#include "registration/cold_start.h"

#include <algorithm>
#include <limits>

#include "registration/in_plane_distance.h"
#include "registration/pose_search.h"
#include "xray_registration/registration/verdict.h"

namespace xray_registration {
namespace {

/// Steps of the search's refinement, of a coarse stage, of the finest.
constexpr int kSearchSteps = 10;
constexpr int kCoarseSteps = 15;
constexpr int kFinestSteps = 8;
/// Places that one search goes on from: a neighbour bone may look better on the coarsest level.
constexpr std::size_t kPlaces = 3;

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

/// One search and the descents from what it found to the level above the finest. `noticed`: leaving rays out changed
/// weights. What is sure needs no other places.
std::vector<Attempt> attemptsFrom(FrameObjective* objective, int coarsest, bool leave_out, const RigidTransform& start,
                                  int first_index, bool* noticed) {
  const RegistrarOptions& options = objective->options();
  *noticed = objective->views().weigh(leave_out, start);
  std::vector<RigidTransform> places = {start};
  if (options.search) {
    const Stage stage{coarsest, coarseSpan(options.similarity), kSearchSteps};
    places = searchAround(objective, stage, start, first_index, kPlaces);
  }
  std::vector<Stage> stages = stagesFrom(coarsest, options);
  if (stages.size() > 1) stages.pop_back();
  std::vector<Attempt> attempts;
  for (const RigidTransform& place : places) {
    if (leave_out && options.search) *noticed |= objective->views().weigh(true, place);
    Solution found;
    found.T_camera_ct = place;
    attempts.push_back({descend(objective, stages, leave_out, found), leave_out});
    const Solution& solution = attempts.back().solution;
    if (!solution.failed && solution.sums.similarity >= options.accept.sure_similarity) break;
  }
  return attempts;
}

/// Whether the X-ray shows the cut as the CT does (a specimen, a phantom) or a body that goes on is not known before:
/// both are tried, what matches better tells, and goes on to the finest level. The others are its rivals.
Attempt searchAndDescend(FrameObjective* objective, int coarsest, const RigidTransform& start, int first_index,
                         Attempts* all) {
  const RegistrarOptions& options = objective->options();
  bool noticed = false;
  std::vector<Attempt> made =
      attemptsFrom(objective, coarsest, options.truncation_weights, start, first_index, &noticed);
  if (noticed) {
    for (const Attempt& whole : attemptsFrom(objective, coarsest, false, start, first_index, &noticed)) {
      made.push_back(whole);
    }
  }
  const std::size_t best_made = all->bestOf(made);
  Attempt best = made[best_made];
  made.erase(made.begin() + static_cast<std::ptrdiff_t>(best_made));
  for (const Attempt& rival : made) all->addRival(rival);
  objective->views().weigh(best.leave_out, best.solution.T_camera_ct);
  const std::vector<Stage> stages = stagesFrom(coarsest, options);
  if (stages.size() > 1 && !best.solution.failed) {
    best.solution.robust_scale2 = objective->robustScale(stages[stages.size() - 2], best.solution.T_camera_ct);
    best.solution = descend(objective, {stages.back()}, best.leave_out, best.solution);
  }
  return best;
}

/// Descends from several places to the level above the finest: the most alike is where to start, the others are rivals.
RigidTransform bestStart(FrameObjective* objective, int coarsest, const std::vector<RigidTransform>& starts,
                         Attempts* all) {
  if (starts.size() == 1) return starts.front();
  const bool leave_out = objective->options().truncation_weights;
  std::vector<Stage> stages = stagesFrom(coarsest, objective->options());
  if (stages.size() > 1) stages.pop_back();
  std::vector<Attempt> found;
  for (const RigidTransform& start : starts) {
    objective->views().weigh(leave_out, start);
    Solution solution;
    solution.T_camera_ct = start;
    found.push_back({descend(objective, stages, leave_out, solution), leave_out});
  }
  const std::size_t best = all->bestOf(found);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (i != best) all->addRival(found[i]);
  }
  return found[best].solution.T_camera_ct;
}

}  // namespace

bool Reach::holds(const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm) const {
  const double moved_mm = (T_camera_ct * centre_ct_mm - T_camera_ct_start * centre_ct_mm).norm();
  return (rotation_rad == 0.0 || rotationAngleBetween(T_camera_ct, T_camera_ct_start) <= rotation_rad) &&
         (translation_mm == 0.0 || moved_mm <= translation_mm);
}

bool Attempts::isUsable(const Attempt& attempt) const {
  return !attempt.solution.failed && reach_.holds(attempt.solution.T_camera_ct, centre_ct_);
}

std::size_t Attempts::bestOf(const std::vector<Attempt>& attempts) const {
  std::size_t best = 0;
  for (std::size_t i = 1; i < attempts.size(); ++i) {
    const Attempt& candidate = attempts[i];
    const Attempt& present = attempts[best];
    const bool better = isUsable(candidate) == isUsable(present)
                            ? !candidate.solution.failed && (present.solution.failed || candidate.solution.likeness() >
                                                                                            present.solution.likeness())
                            : isUsable(candidate);
    if (better) best = i;
  }
  return best;
}

const Attempt& Attempts::best() const { return all_[bestOf(all_)]; }

double Attempts::disagreementMm() const {
  double nearest = std::numeric_limits<double>::max();
  const std::size_t best = bestOf(all_);
  if (all_[best].solution.failed) return nearest;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    if (i == best || all_[i].solution.failed) continue;
    nearest =
        std::min(nearest, inPlaneDistance(all_[best].solution.T_camera_ct, all_[i].solution.T_camera_ct, centre_ct_));
  }
  return nearest;
}

Rival Attempts::rival() const {
  const Solution& winner = best().solution;
  Rival nearest_by;
  const auto consider = [&](const Attempt& other) {
    // Where the CT cannot be, nothing has to be told from it.
    if (!isUsable(other)) return;
    const double distance_mm = inPlaneDistance(winner.T_camera_ct, other.solution.T_camera_ct, centre_ct_);
    if (distance_mm < kOtherPlaceMm || other.solution.likeness() <= nearest_by.similarity) return;
    nearest_by = {other.solution.likeness(), distance_mm};
  };
  for (const Attempt& other : all_) consider(other);
  for (const Attempt& other : rivals_) consider(other);
  return nearest_by;
}

ColdStartResult startCold(FrameObjective* objective, const std::vector<RigidTransform>& starts) {
  // Other poses around the same start, and a finer level: a right answer is found twice, a wrong one rarely.
  constexpr int kMostAttempts = 4;
  const RegistrarOptions& options = objective->options();
  const AcceptOptions accept = thresholdsFor(objective->views().size(), options.accept);
  const int coarsest = objective->views().coarsestLevel(starts.front());
  Attempts attempts(objective->views().centreCt(),
                    {starts.front(), options.reach_rotation_rad, options.reach_translation_mm});
  const RigidTransform start = bestStart(objective, coarsest, starts, &attempts);
  std::optional<Confirmation> confirmation;
  for (int i = 0; i < kMostAttempts && !objective->exceeded(); ++i) {
    const int level = i == 0 ? coarsest : std::max(coarsest - 1, 0);
    attempts.add(searchAndDescend(objective, level, start, 1 + i * options.search_poses, &attempts));
    const Solution& best = attempts.best().solution;
    const bool sure = !best.failed && best.likeness() >= options.accept.sure_similarity &&
                      standsAlone(best.likeness(), best.sums.inlier_fraction, accept);
    confirmation.reset();
    if (!options.search || sure) break;
    confirmation = Confirmation{attempts.disagreementMm(), attempts.rival()};
    const bool stands_out = best.likeness() - confirmation->rival.similarity >= options.accept.min_margin;
    if (confirmation->disagreement_mm <= options.accept.max_disagreement_mm && stands_out) break;
  }
  const Attempt& best = attempts.best();
  const Solution& found = best.solution;
  return {found,
          start,
          {coarsest, found.robust_scale2, best.leave_out, found.likeness(), found.sums.inlier_fraction},
          confirmation};
}

}  // namespace xray_registration
