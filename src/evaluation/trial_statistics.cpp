#include "xray_registration/evaluation/trial_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace xray_registration {
namespace {

template <typename Get>
Percentiles percentilesOf(const std::vector<Trial>& trials, const Get& get) {
  std::vector<double> values;
  values.reserve(trials.size());
  for (const Trial& trial : trials) values.push_back(get(trial));
  return percentiles(values);
}

template <typename Predicate>
int count(const std::vector<Trial>& trials, const Predicate& predicate) {
  return static_cast<int>(std::count_if(trials.begin(), trials.end(), predicate));
}

}  // namespace

bool SuccessCriteria::isSuccess(const PoseError& error) const {
  return error.mtre_mm < max_mtre_mm && error.inplane_mm < max_inplane_mm;
}

bool SuccessCriteria::isFalseAcceptance(const Trial& trial) const {
  return trial.result.accepted && isWrong(trial.final);
}

bool SuccessCriteria::isFalseRefusal(const Trial& trial) const {
  return !trial.result.accepted && isSuccess(trial.final);
}

SuccessCriteria successCriteria(int views) {
  SuccessCriteria criteria;
  if (views > 1) {
    criteria.max_mtre_mm = 1.0;
    criteria.max_inplane_mm = std::numeric_limits<double>::infinity();
    criteria.false_acceptance_mtre_mm = 2.0;
  }
  return criteria;
}

std::vector<StartBin> startBins(const std::vector<Trial>& trials, const SuccessCriteria& criteria, double width_mm) {
  std::vector<StartBin> bins;
  for (const Trial& trial : trials) {
    if (!std::isfinite(trial.start.mtre_mm)) continue;  // From nothing.
    const std::size_t index = static_cast<std::size_t>(trial.start.mtre_mm / width_mm);
    while (bins.size() <= index) {
      const double from_mm = static_cast<double>(bins.size()) * width_mm;
      bins.push_back({from_mm, from_mm + width_mm, 0, 0});
    }
    ++bins[index].trials;
    if (criteria.isSuccess(trial.final)) ++bins[index].successes;
  }
  return bins;
}

double captureRange(const std::vector<StartBin>& bins, int min_trials, double min_success) {
  double captured_mm = 0.0;
  StartBin joined;
  for (const StartBin& bin : bins) {
    joined.to_mm = bin.to_mm;
    joined.trials += bin.trials;
    joined.successes += bin.successes;
    if (joined.trials < min_trials) continue;
    if (joined.successRate() < min_success) break;
    captured_mm = joined.to_mm;
    joined = StartBin{};
  }
  return captured_mm;
}

TrialStatistics statisticsOf(const std::vector<Trial>& trials, const SuccessCriteria& criteria) {
  TrialStatistics statistics;
  statistics.trials = static_cast<int>(trials.size());
  statistics.successes = count(trials, [&](const Trial& t) { return criteria.isSuccess(t.final); });
  statistics.gross_failures = count(trials, [&](const Trial& t) { return criteria.isGrossFailure(t.final); });
  statistics.accepted = count(trials, [](const Trial& t) { return t.result.accepted; });
  statistics.false_acceptances = count(trials, [&](const Trial& t) { return criteria.isFalseAcceptance(t); });
  statistics.false_refusals = count(trials, [&](const Trial& t) { return criteria.isFalseRefusal(t); });
  statistics.start_mtre_mm = percentilesOf(trials, [](const Trial& t) { return t.start.mtre_mm; });
  statistics.final_mtre_mm = percentilesOf(trials, [](const Trial& t) { return t.final.mtre_mm; });
  statistics.final_inplane_mm = percentilesOf(trials, [](const Trial& t) { return t.final.inplane_mm; });
  statistics.prepare_ms = percentilesOf(trials, [](const Trial& t) { return t.prepare_ms; });
  statistics.solve_ms = percentilesOf(trials, [](const Trial& t) { return t.solve_ms; });
  statistics.frame_ms = percentilesOf(trials, [](const Trial& t) { return t.prepare_ms + t.solve_ms; });
  statistics.iterations =
      percentilesOf(trials, [](const Trial& t) { return static_cast<double>(t.result.iterations); });
  statistics.bins = startBins(trials, criteria);
  statistics.capture_range_mm = captureRange(statistics.bins);
  return statistics;
}

}  // namespace xray_registration
