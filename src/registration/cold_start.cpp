#include "registration/cold_start.h"

#include <algorithm>
#include <limits>
#include <optional>

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

/// Share of the finest level's tiles that a first step there is taken on.
constexpr double kTilesOnTheWay = 0.4;
/// On a level a place that is less alike than another one by so much, after some steps, is not gone on with: rivals
/// count down to accept/clear_margin (0.06) below the best, and no trial's verdict changed by it.
constexpr double kHopeless = 0.1;
/// Share of the way from a sure likeness to 1 from which on a search around the start could find nothing better (0.96).
/// Wrong results around a start reach 0.87 (the head from the front, mirrored), and a smooth phantom, turned by 34
/// degrees in the image, was 0.90 alike 12 mm away from where it was.
constexpr double kNothingBetter = 0.8;

/// Coarse to fine, down to the level above the finest; the finest itself where there is no other.
std::vector<Stage> coarseStages(int first, const RegistrarOptions& options) {
  std::vector<Stage> stages;
  for (int level = first; level >= 1; --level) stages.push_back(stageOn(level, kCoarseSteps, options.similarity));
  if (stages.empty()) stages.push_back(stageOn(0, kFinestSteps, options.similarity));
  return stages;
}

/// The search has already been on the coarsest level.
int levelBelowSearch(int coarsest, const RegistrarOptions& options) {
  return options.search && coarsest > 1 ? coarsest - 1 : coarsest;
}

/// The most alike that anything was so far, by stage.
using MostAlike = std::vector<double>;

/// Runs one stage as FrameObjective::solve does. What is less alike than `hopeless` after some evaluations is left
/// there, unconverged.
bool solveUnlessHopeless(FrameObjective* objective, const Stage& stage, double hopeless, Solution* solution) {
  constexpr int kPatience = 6;
  int evaluations = 0;
  double most = -1.0;
  const auto evaluate = [&](const RigidTransform& pose) -> std::optional<StepSums> {
    if (evaluations++ >= kPatience && most < hopeless) return std::nullopt;
    const std::vector<StepSums> sums = objective->evaluate(stage, solution->robust_scale2, {pose});
    if (sums.empty()) return std::nullopt;
    most = std::max(most, sums.front().similarity);
    return sums.front();
  };
  const RigidTransform start = solution->T_camera_ct;
  const GaussNewtonResult end =
      minimise(evaluate, start, objective->views().centreCt(), objective->solverFor(stage, start));
  solution->converged = false;
  if (end.steps == 0) return false;
  static_cast<GaussNewtonResult&>(*solution) = end;
  return true;
}

/// Goes through the stages from `start`; the weights are set, and renewed from each stage to the next. What is hopeless
/// beside `most` is left on its way.
Solution descend(FrameObjective* objective, const std::vector<Stage>& stages, bool leave_out, const Solution& start,
                 MostAlike* most) {
  most->resize(stages.size(), -1.0);
  Solution solution = start;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    if (i > 0 && leave_out) objective->views().weigh(true, solution.T_camera_ct);
    if (i > 0) solution.robust_scale2 = objective->robustScale(stages[i - 1], solution.T_camera_ct);
    const double coarser_similarity = solution.sums.similarity;
    const double hopeless = (*most)[i] - kHopeless;
    if (!solveUnlessHopeless(objective, stages[i], hopeless, &solution)) break;
    solution.coarser_similarity = coarser_similarity;
    if (solution.failed || solution.sums.similarity < hopeless) break;
    (*most)[i] = std::max((*most)[i], solution.sums.similarity);
  }
  return solution;
}

Solution at(const RigidTransform& T_camera_ct) {
  Solution solution;
  solution.T_camera_ct = T_camera_ct;
  return solution;
}

bool isSure(const Attempt& attempt, const RegistrarOptions& options) {
  return !attempt.solution.failed && attempt.solution.sums.similarity >= options.accept.sure_similarity;
}

/// So alike that a search could find nothing better.
double likenessBeyondDoubt(const RegistrarOptions& options) {
  const double sure = options.accept.sure_similarity;
  return sure + kNothingBetter * (1.0 - sure);
}

/// Whether rays that the CT cannot explain are left out, and on which level a search looks.
struct Manner {
  int coarsest = 0;
  bool leave_out = false;
  bool noticed = false;  ///< Leaving rays out changed weights.
};

/// The descents from places to the level above the finest. What is sure needs no other places.
std::vector<Attempt> attemptsFrom(FrameObjective* objective, const std::vector<RigidTransform>& places,
                                  const Attempts& all, Manner* manner) {
  const RegistrarOptions& options = objective->options();
  const std::vector<Stage> stages = coarseStages(levelBelowSearch(manner->coarsest, options), options);
  std::vector<Attempt> attempts;
  MostAlike most;
  for (const RigidTransform& place : places) {
    manner->noticed |= objective->views().weigh(manner->leave_out, place);
    MostAlike with_this = most;
    attempts.push_back({descend(objective, stages, manner->leave_out, at(place), &with_this), manner->leave_out});
    if (all.isUsable(attempts.back())) most = with_this;  // What is out of reach outdoes nothing.
    if (isSure(attempts.back(), options)) break;
  }
  return attempts;
}

bool isBeyondDoubt(const Attempt& attempt, const RegistrarOptions& options) {
  return !attempt.solution.failed && attempt.solution.sums.similarity >= likenessBeyondDoubt(options);
}

/// From the start alone, as long as it is so alike that a search could find nothing better; else nothing.
std::vector<Attempt> attemptFromStart(FrameObjective* objective, const RigidTransform& start, const Attempts& all,
                                      Manner* manner) {
  const RegistrarOptions& options = objective->options();
  const double enough = likenessBeyondDoubt(options);
  const std::vector<Stage> stages = coarseStages(manner->coarsest, options);
  MostAlike most(stages.size(), enough + kHopeless);
  manner->noticed |= objective->views().weigh(manner->leave_out, start);
  const Attempt attempt{descend(objective, stages, manner->leave_out, at(start), &most), manner->leave_out};
  if (!all.isUsable(attempt) || attempt.solution.sums.similarity < enough) return {};
  return {attempt};
}

/// A search and the descents from what it found. The first one of a cold start is left out where the start itself leads
/// to what is sure; a later one ranks on the coarsest level, too, and goes on from a finer one.
std::vector<Attempt> searchFrom(FrameObjective* objective, const RigidTransform& start, int attempt,
                                const Attempts& all, Manner* manner) {
  const RegistrarOptions& options = objective->options();
  if (!options.search) return attemptsFrom(objective, {start}, all, manner);
  if (attempt == 0) {
    std::vector<Attempt> direct = attemptFromStart(objective, start, all, manner);
    if (!direct.empty()) return direct;
  }
  manner->noticed |= objective->views().weigh(manner->leave_out, start);
  const Stage ranked_on{manner->coarsest, coarseSpan(options.similarity), kSearchSteps};
  Stage refined_on = ranked_on;
  if (attempt > 0) refined_on.level = manner->coarsest = std::max(manner->coarsest - 1, 0);
  return attemptsFrom(
      objective, searchAround(objective, ranked_on, refined_on, start, 1 + attempt * options.search_poses, kPlaces),
      all, manner);
}

/// Whether the X-ray shows the cut as the CT does (a specimen, a phantom) or a body that goes on is not known before:
/// both are tried, and what matches better tells. Where one of them leaves no doubt, the other one is looked at there
/// only. Merely sure is not enough: with a focal length that is 2 % off one way was 0.82 alike, and the other 0.91
/// elsewhere.
std::vector<Attempt> searchBothWays(FrameObjective* objective, int coarsest, const RigidTransform& start, int attempt,
                                    const Attempts& all) {
  const RegistrarOptions& options = objective->options();
  Manner as_cut{coarsest, options.truncation_weights, false};
  std::vector<Attempt> made = searchFrom(objective, start, attempt, all, &as_cut);
  if (!as_cut.noticed) return made;
  const Attempt& best = made[all.bestOf(made)];
  Manner whole{coarsest, false, false};
  const std::vector<Attempt> more = isBeyondDoubt(best, options)
                                        ? attemptsFrom(objective, {best.solution.T_camera_ct}, all, &whole)
                                        : searchFrom(objective, start, attempt, all, &whole);
  made.insert(made.end(), more.begin(), more.end());
  return made;
}

/// Goes on to the finest level, where there is another one above it.
void finish(FrameObjective* objective, int coarsest, Attempt* attempt) {
  const RegistrarOptions& options = objective->options();
  objective->views().weigh(attempt->leave_out, attempt->solution.T_camera_ct);
  if (coarsest == 0 || attempt->solution.failed) return;
  const Stage coarse = coarseStages(1, options).front();
  attempt->solution.robust_scale2 = objective->robustScale(coarse, attempt->solution.T_camera_ct);
  // The way there on some of the tiles, as a tracked frame goes it; the result on all of them.
  const Solution coarser = attempt->solution;
  objective->views().keepContrastTiles(kTilesOnTheWay);
  objective->solve(stageOn(0, 1, options.similarity), &attempt->solution);
  objective->views().useAllTiles();
  if (attempt->solution.failed) attempt->solution = coarser;
  attempt->solution.sums = coarser.sums;
  MostAlike most;
  attempt->solution =
      descend(objective, {stageOn(0, kFinestSteps, options.similarity)}, attempt->leave_out, attempt->solution, &most);
}

/// The best of a search goes on to the finest level, unless it only finds the best again; the others are its rivals.
void searchAndDescend(FrameObjective* objective, int coarsest, const RigidTransform& start, int attempt,
                      Attempts* all) {
  // The finest level moves a place by less than that.
  constexpr double kSamePlace = 0.5;
  std::vector<Attempt> made = searchBothWays(objective, coarsest, start, attempt, *all);
  const std::size_t best_made = all->bestOf(made);
  Attempt best = made[best_made];
  made.erase(made.begin() + static_cast<std::ptrdiff_t>(best_made));
  for (const Attempt& rival : made) all->addRival(rival);
  if (attempt > 0 && all->distanceMm(best) < kSamePlace * objective->options().accept.max_disagreement_mm) {
    all->addConfirmation(best);
    return;
  }
  finish(objective, attempt == 0 ? coarsest : std::max(coarsest - 1, 0), &best);
  all->add(best);
}

/// Descends from several places to the level above the finest: the most alike is where to start, the others are rivals.
RigidTransform bestStart(FrameObjective* objective, int coarsest, const std::vector<RigidTransform>& starts,
                         Attempts* all) {
  if (starts.size() == 1) return starts.front();
  const bool leave_out = objective->options().truncation_weights;
  const std::vector<Stage> stages =
      coarseStages(levelBelowSearch(coarsest, objective->options()), objective->options());
  std::vector<Attempt> found;
  MostAlike most;
  for (const RigidTransform& start : starts) {
    objective->views().weigh(leave_out, start);
    found.push_back({descend(objective, stages, leave_out, at(start), &most), leave_out});
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

double Attempts::distanceMm(const Attempt& attempt) const {
  const Attempt& winner = best();
  if (winner.solution.failed || attempt.solution.failed) return std::numeric_limits<double>::max();
  return inPlaneDistance(winner.solution.T_camera_ct, attempt.solution.T_camera_ct, centre_ct_);
}

double Attempts::disagreementMm() const {
  double nearest = std::numeric_limits<double>::max();
  const std::size_t best = bestOf(all_);
  for (std::size_t i = 0; i < all_.size(); ++i) {
    if (i != best) nearest = std::min(nearest, distanceMm(all_[i]));
  }
  for (const Attempt& confirmation : confirmations_) nearest = std::min(nearest, distanceMm(confirmation));
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
    searchAndDescend(objective, coarsest, start, i, &attempts);
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
          {coarsest, found.robust_scale2, best.leave_out, found.likeness(), found.sums.inlier_fraction},
          confirmation};
}

}  // namespace xray_registration
