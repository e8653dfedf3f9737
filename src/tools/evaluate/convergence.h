#pragma once

#include <vector>

#include "xray_registration/evaluation/trials.h"

namespace xray_registration::tools {

/// How one trial came closer: error after so many steps.
struct ConvergenceCurve {
  std::vector<int> steps;
  std::vector<double> mtre_mm;
};

/// Repeats the first `count` trials with growing budgets of steps and measures how far each came. Solvers are
/// deterministic, so a budget of n shows where the full run stood after n steps. The pipeline has its tuning back
/// afterwards.
std::vector<ConvergenceCurve> convergenceOf(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames,
                                            const std::vector<Trial>& trials, const Eigen::Vector3d& centre_ct_mm,
                                            double target_size_mm, std::size_t count = 8);

}  // namespace xray_registration::tools
