#pragma once

#include <optional>

#include "registration/cold_start.h"
#include "registration/device_views.h"
#include "registration/solution.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// How a frame was solved, as far as the verdict asks.
struct SolveHistory {
  RigidTransform T_camera_ct_start = RigidTransform::Identity();
  bool predicted = false;  ///< The start is the prediction from an accepted neighbour.
  bool searched = false;   ///< A cold start.
  int exceeded_steps = 0;
  double found_similarity = 1.0;  ///< Of the cold start that a tracked frame follows.
  double found_inlier_fraction = 1.0;
  std::optional<Confirmation> confirmation;  ///< Of a cold start whose likeness alone is not sure.
};

/// The pose's covariance from the sums at the solution (judgement.cpp has the formula and its sources).
Matrix6d covarianceOf(const StepSums& sums, int span);

/// The numbers of the solution, with its covariance, into the result.
void describe(const Solution& solution, int span, RegistrationResult* result);

/// Fills the result's numbers from the solution, with its covariance, and accepts or refuses it.
void judge(const DeviceViews& views, const Solution& solution, const SolveHistory& history,
           const RegistrarOptions& options, RegistrationResult* result);

}  // namespace xray_registration
