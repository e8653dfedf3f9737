#include "xray_registration/evaluation/operating_curve.h"

#include <algorithm>
#include <limits>

namespace xray_registration {

std::vector<OperatingPoint> operatingCurve(const std::vector<Trial>& trials, const SuccessCriteria& criteria,
                                           const std::function<double(const Trial&)>& cue) {
  struct Judged {
    double cue;
    bool good;
  };
  std::vector<Judged> judged;
  double good = 0.0;
  double wrong = 0.0;
  for (const Trial& trial : trials) {
    const bool is_good = criteria.isSuccess(trial.final);
    if (!is_good && trial.final.mtre_mm <= criteria.false_acceptance_mtre_mm) continue;
    judged.push_back({cue(trial), is_good});
    (is_good ? good : wrong) += 1.0;
  }
  if (good == 0.0 || wrong == 0.0) return {};
  std::sort(judged.begin(), judged.end(), [](const Judged& a, const Judged& b) { return a.cue > b.cue; });

  std::vector<OperatingPoint> curve = {{std::numeric_limits<double>::infinity(), 0.0, 0.0}};
  double good_accepted = 0.0;
  double wrong_accepted = 0.0;
  for (std::size_t i = 0; i < judged.size(); ++i) {
    (judged[i].good ? good_accepted : wrong_accepted) += 1.0;
    // Equal cues pass a threshold together.
    if (i + 1 < judged.size() && judged[i + 1].cue == judged[i].cue) continue;
    curve.push_back({judged[i].cue, good_accepted / good, wrong_accepted / wrong});
  }
  return curve;
}

}  // namespace xray_registration
