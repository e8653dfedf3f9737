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

std::vector<ConvergenceCurve> convergenceOf(Registrar* registrar, const RegistrarOptions& options,
                                            const std::vector<EvaluationFrame>& frames,
                                            const std::vector<Trial>& trials, const Eigen::Vector3d& centre_ct_mm,
                                            double target_size_mm, std::size_t count) {
  const std::vector<Eigen::Vector3d> targets_ct_mm = targetGrid(centre_ct_mm, target_size_mm);
  std::vector<ConvergenceCurve> curves(std::min(count, trials.size()));
  int longest = 0;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    curves[i].steps.push_back(0);
    curves[i].mtre_mm.push_back(trials[i].start.mtre_mm);
    longest = std::max(longest, trials[i].result.iterations);
  }
  // The budget is that of one descent; a search that was repeated has counted several.
  longest = std::min(longest, std::max(options.max_steps_per_frame, options.paper_max_iterations));
  ProgressBar bar("convergence", static_cast<std::size_t>(longest));
  // Each point is a whole registration, so they lie closer where more happens.
  for (int budget = 1; budget <= longest; budget += 1 + budget / 5) {
    bar.advanceTo(static_cast<std::size_t>(budget));
    RegistrarOptions limited = options;
    limited.max_steps_per_frame = budget;
    limited.paper_max_iterations = budget;
    if (!registrar->setOptions(limited)) return {};
    for (std::size_t i = 0; i < curves.size(); ++i) {
      if (budget >= trials[i].result.iterations) continue;
      const EvaluationFrame& frame = frameOf(trials[i], frames);
      const RigidTransform T_camera_ct_start =
          updatedPose(frame.T_camera_ct_true, trials[i].disturbance, frame.T_camera_ct_true * centre_ct_mm);
      const RegistrationResult result = registrar->registerFrame(frame.views, T_camera_ct_start, false);
      curves[i].steps.push_back(budget);
      curves[i].mtre_mm.push_back(poseError(result.T_camera_ct, frame.T_camera_ct_true, targets_ct_mm).mtre_mm);
    }
  }
  registrar->setOptions(options);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    curves[i].steps.push_back(std::max(trials[i].result.iterations, 1));
    curves[i].mtre_mm.push_back(trials[i].final.mtre_mm);
  }
  return curves;
}

}  // namespace xray_registration::tools
