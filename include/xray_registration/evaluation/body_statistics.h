#pragma once

#include <string>
#include <vector>

#include "xray_registration/common/statistics.h"
#include "xray_registration/evaluation/trial.h"

namespace xray_registration {

/// One body over many trials. A result is good below 1 mm of mean target error, and wrong above 2 mm; with a single
/// view, which hardly sees depth, the error is the in-plane one.
struct BodyStatistics {
  std::string name;
  int trials = 0;
  int successes = 0;
  int accepted = 0;
  int false_acceptances = 0;
  int false_refusals = 0;  ///< Successes that were refused.
  Percentiles mtre_mm;
  Percentiles inplane_mm;
};

/// Of all bodies whose truth was known, in their order.
std::vector<BodyStatistics> bodyStatisticsOf(const std::vector<Trial>& trials, std::size_t views);

}  // namespace xray_registration
