#pragma once

#include <functional>
#include <vector>

#include "xray_registration/evaluation/trial_statistics.h"

namespace xray_registration {

/// One threshold of a cue: which part of the good results it would accept, and which part of the wrong ones.
struct OperatingPoint {
  double threshold = 0.0;
  double true_acceptance = 0.0;
  double false_acceptance = 0.0;
};

/// Sweeps a threshold over `cue` (larger is better) from accept-nothing to accept-all. Good: success. Wrong: too far
/// off to be accepted (SuccessCriteria::false_acceptance_mtre_mm). What lies between is neither. Empty when there is no
/// good or no wrong result.
std::vector<OperatingPoint> operatingCurve(const std::vector<Trial>& trials, const SuccessCriteria& criteria,
                                           const std::function<double(const Trial&)>& cue);

}  // namespace xray_registration
