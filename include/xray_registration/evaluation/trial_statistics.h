#pragma once

#include <vector>

#include "xray_registration/common/statistics.h"
#include "xray_registration/evaluation/trial.h"

namespace xray_registration {

/// What counts as good, bad and dangerous. All lengths in mm.
struct SuccessCriteria {
  double max_mtre_mm = 3.0;
  double max_inplane_mm = 0.5;            ///< Infinite with several views.
  double gross_mtre_mm = 10.0;            ///< Gross failure above.
  double false_acceptance_mtre_mm = 5.0;  ///< An accepted result above this is a false acceptance.

  bool isSuccess(const PoseError& error) const;
  bool isGrossFailure(const PoseError& error) const { return error.mtre_mm > gross_mtre_mm; }
  /// Too far off to be accepted; what is neither a success nor wrong is tolerable.
  bool isWrong(const PoseError& error) const { return error.mtre_mm > false_acceptance_mtre_mm; }
  bool isFalseAcceptance(const Trial& trial) const;
  bool isFalseRefusal(const Trial& trial) const;
};

/// A single view hardly sees depth: in-plane < 0.5 mm and mTRE < 3 mm. Several views: mTRE < 1 mm.
SuccessCriteria successCriteria(int views);

/// Trials whose start mTRE lies in [from, to).
struct StartBin {
  double from_mm = 0.0;
  double to_mm = 0.0;
  int trials = 0;
  int successes = 0;

  double successRate() const { return trials > 0 ? static_cast<double>(successes) / trials : 0.0; }
};

struct TrialStatistics {
  int trials = 0;
  int successes = 0;
  int gross_failures = 0;
  int accepted = 0;
  int false_acceptances = 0;
  int false_refusals = 0;  ///< Successes that were refused.
  Percentiles start_mtre_mm;
  Percentiles final_mtre_mm;
  Percentiles final_inplane_mm;
  Percentiles prepare_ms;
  Percentiles solve_ms;
  Percentiles frame_ms;  ///< Image in memory → verdict: prepare + solve.
  Percentiles iterations;
  std::vector<StartBin> bins;
  double capture_range_mm = 0.0;

  double successRate() const { return trials > 0 ? static_cast<double>(successes) / trials : 0.0; }
  double grossFailureRate() const { return trials > 0 ? static_cast<double>(gross_failures) / trials : 0.0; }
  double acceptedRate() const { return trials > 0 ? static_cast<double>(accepted) / trials : 0.0; }
  /// Of all trials.
  double falseAcceptanceRate() const { return trials > 0 ? static_cast<double>(false_acceptances) / trials : 0.0; }
  /// Of the good ones.
  double falseRefusalRate() const { return successes > 0 ? static_cast<double>(false_refusals) / successes : 0.0; }
};

/// Start bins of `width_mm` from zero to the farthest start.
std::vector<StartBin> startBins(const std::vector<Trial>& trials, const SuccessCriteria& criteria,
                                double width_mm = 2.0);

/// The largest start mTRE up to which every bin reaches `min_success`. A bin with fewer than `min_trials` is joined
/// with those after it until they have as many together, so that no failure is lost in a thin bin; what stays below
/// `min_trials` at the far end is not judged and not counted as captured.
double captureRange(const std::vector<StartBin>& bins, int min_trials = 20, double min_success = 0.95);

TrialStatistics statisticsOf(const std::vector<Trial>& trials, const SuccessCriteria& criteria);

}  // namespace xray_registration
