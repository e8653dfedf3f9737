#pragma once

#include <string>
#include <vector>

#include "registration/device_views.h"
#include "registration/solution.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/suspicion.h"

namespace xray_registration {

/// What side, orientation and order of the views look like.
struct DiscreteOpinion {
  std::vector<SetupSuspicion> suspicions;  ///< Only what explains the X-rays better.
  std::string refusal;                     ///< In words; empty when what was told explains them best.
};

/// Tries a cold start's frame with its images mirrored, turned, inverted, exchanged, and with the CT mirrored: small
/// copies are searched from the same start, and what resembles the DRR more than the solution does, by more than
/// chance, is the better explanation. `found`: the solution can be trusted as far as likeness goes; then only what
/// leaves a body looking nearly the same is asked. @throws DeviceError.
DiscreteOpinion checkDiscrete(Engine* engine, const std::vector<ViewInput>& views,
                              const RigidTransform& T_camera_ct_start, const Solution& solution, bool found,
                              const RegistrarOptions& options);

}  // namespace xray_registration
