#include "registration/fast_wide_search.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "registration/in_plane_distance.h"
#include "registration/pose_search.h"

namespace xray_registration {
namespace {

constexpr std::size_t kOrientationsAtOnce = 16;  // A slice.
constexpr std::size_t kCandidates = 128;         // That are looked at on the coarsest level,
constexpr std::size_t kRefined = 32;             // refined there,
constexpr std::size_t kOfABone = 3;              // so many times more of a bone among others,
constexpr std::size_t kPlaces = 8;               // and refined on the next.
constexpr double kHopeless = 0.15;  // Likeness that a place lacks against the best, not to be gone on from.
constexpr int kSteps = 12;
constexpr double kPixels = 20000.0;    // Of a view with CT behind them: what refines need not be fine.
constexpr double kRankingShare = 0.7;  // Of the work, about.

/// Without those that are far less alike than the best.
std::vector<GaussNewtonResult> hopeful(const std::vector<GaussNewtonResult>& results) {
  double best = -1.0;
  for (const GaussNewtonResult& result : results) best = std::max(best, result.sums.similarity);
  std::vector<GaussNewtonResult> kept;
  for (const GaussNewtonResult& result : results) {
    if (result.sums.similarity >= best - kHopeless) kept.push_back(result);
  }
  return kept;
}

}  // namespace

FastWideSearch::FastWideSearch(Engine* engine, std::vector<ViewInput> inputs, const RegistrarOptions& options,
                               const WideSearchRange& range)
    : inputs_(std::move(inputs)),
      options_(options),
      ranking_(engine, inputs_, range),
      budget_(std::numeric_limits<int>::max()),
      views_(engine),
      objective_(engine, &views_, options_, &budget_) {}

double FastWideSearch::progress() const {
  if (!places_.empty()) return 1.0;
  const double refined = std::min(1.0, steps_ / (2.0 * kSteps));
  return kRankingShare * ranking_.share() + (1.0 - kRankingShare) * refined;
}

bool FastWideSearch::advance() {
  if (!places_.empty()) return false;
  if (descents_) return refine();
  best_similarity_ = ranking_.bestScore();
  if (ranking_.look(kOrientationsAtOnce)) return true;
  beginRefining();
  return descents_.has_value();
}

std::vector<StepSums> FastWideSearch::evaluate(const std::vector<RigidTransform>& poses) {
  return objective_.evaluate(stage_, kNotRobust, poses);
}

/// The candidates' order by small DRRs is not the objective's: all are evaluated, and the best by either go on.
void FastWideSearch::beginRefining() {
  const std::size_t more = ranking_.isAmongOthers() ? kOfABone : 1;
  std::vector<RigidTransform> candidates;
  for (const RankedPlace& ranked : ranking_.best(kCandidates * more)) candidates.push_back(ranked.T_camera_ct);
  if (candidates.empty()) return;
  views_.upload(inputs_, candidates.front(), kPixels);
  coarsest_ = views_.coarsestLevel(candidates.front());
  stage_ = {coarsest_, coarseSpan(options_.similarity), kSteps};
  const std::vector<StepSums> sums = evaluate(candidates);
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return orderedCost(sums[a]) < orderedCost(sums[b]); });
  std::vector<RigidTransform> starts;
  std::vector<bool> taken(candidates.size(), false);
  const auto take = [&](std::size_t i) {
    if (taken[i] || starts.size() >= kRefined * more) return;
    taken[i] = true;
    starts.push_back(candidates[i]);
  };
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    take(order[i]);
    take(i);
  }
  beginLevel(starts);
}

void FastWideSearch::beginLevel(const std::vector<RigidTransform>& starts) {
  descents_.emplace(starts, views_.centreCt(), objective_.solverFor(stage_, starts.front()));
}

bool FastWideSearch::refine() {
  ++steps_;
  if (descents_->advance([this](const std::vector<RigidTransform>& poses) { return evaluate(poses); })) return true;
  const std::vector<GaussNewtonResult> results = descents_->results();
  for (const GaussNewtonResult& result : results) {
    if (!result.failed) best_similarity_ = std::max(best_similarity_, result.sums.similarity);
  }
  std::vector<RigidTransform> places = placesOf(hopeful(results), views_.centreCt(), kPlaces);
  if (stage_.level == coarsest_ && coarsest_ > 0) {
    --stage_.level;
    beginLevel(places);
    return true;
  }
  places_ = std::move(places);
  return false;
}

}  // namespace xray_registration
