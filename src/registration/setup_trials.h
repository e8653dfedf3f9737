#pragma once

#include <optional>
#include <string>
#include <vector>

#include "registration/residual_field.h"
#include "registration/score_test.h"
#include "registration/setup_hypotheses.h"
#include "registration/solution.h"

namespace xray_registration {

/// What explains the X-rays better than what was told.
struct SetupCause {
  std::string in_words;  ///< What is how far off, and what to do about it.
  ResidualField left;    ///< What moves in the images when that is put right.
};

/// Tries hypotheses whose score tests (one each) are far from zero: solves for the set-up with the pose. What explains
/// the X-rays best for the number of its parameters is the cause, when it does so by more than chance and the pose
/// moves by more than `limit_mm`.
std::optional<SetupCause> tryHypotheses(SetupObjective* objective, const Solution& solution, int level,
                                        const std::vector<SetupHypothesis>& hypotheses,
                                        const std::vector<ScoreTest>& tests, double limit_mm);

}  // namespace xray_registration
