#pragma once

#include <optional>

#include "registration/setup_objective.h"

namespace xray_registration {

/// A set-up that was solved for, with what was seen there.
struct SetupSolution {
  Setup setup;
  SetupEvidence evidence;
};

/// Damped Gauss-Newton in the pose and the parameters of a basis (layout × parameters, without pose), from a set-up.
/// Nothing when the budget is used up or nothing finite was found.
std::optional<SetupSolution> solveSetup(SetupObjective* objective, const Stage& stage, double robust_scale2,
                                        const Eigen::MatrixXd& basis, const Setup& start);

}  // namespace xray_registration
