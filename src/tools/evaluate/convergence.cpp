#include "tools/evaluate/convergence.h"

#include <algorithm>

#include "tools/common/progress_bar.h"

namespace xray_registration::tools {
namespace {

const EvaluationFrame& frameOf(const Trial& trial, const std::vector<EvaluationFrame>& frames) {
  return *std::find_if(frames.begin(), frames.end(),
                       [&trial](const EvaluationFrame& frame) { return frame.index == trial.frame; });
}

}  // namespace

std::vector<ConvergenceCurve> convergenceOf(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames,
                                            const std::vector<Trial>& trials, const Eigen::Vector3d& centre_ct_mm,
                                            double target_size_mm, std::size_t count) {
  const NodeParameters parameters = pipeline->parameters();
  std::vector<ConvergenceCurve> curves(std::min(count, trials.size()));
  int longest = 0;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    curves[i].steps.push_back(0);
    curves[i].mtre_mm.push_back(trials[i].start.mtre_mm);
    longest = std::max(longest, trials[i].result.iterations);
  }
  // The budget is that of one descent; a search that was repeated has counted several.
  longest =
      std::min(longest, std::max(parameters.registrar.max_steps_per_frame, parameters.registrar.paper_max_iterations));
  ProgressBar bar("convergence", static_cast<std::size_t>(longest));
  // Each point is a whole registration, so they lie closer where more happens.
  for (int budget = 1; budget <= longest; budget += 1 + budget / 5) {
    bar.advanceTo(static_cast<std::size_t>(budget));
    RegistrarOptions limited = parameters.registrar;
    limited.max_steps_per_frame = budget;
    limited.paper_max_iterations = budget;
    pipeline->setTuning(limited, parameters.tracker);
    for (std::size_t i = 0; i < curves.size(); ++i) {
      if (budget >= trials[i].result.iterations) continue;
      const Trial limited_trial =
          runTrial(pipeline, frameOf(trials[i], frames), trials[i].disturbance, centre_ct_mm, target_size_mm);
      curves[i].steps.push_back(budget);
      curves[i].mtre_mm.push_back(limited_trial.final.mtre_mm);
    }
  }
  pipeline->setTuning(parameters.registrar, parameters.tracker);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    curves[i].steps.push_back(std::max(trials[i].result.iterations, 1));
    curves[i].mtre_mm.push_back(trials[i].final.mtre_mm);
  }
  return curves;
}

}  // namespace xray_registration::tools
