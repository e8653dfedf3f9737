#pragma once

#include <optional>

#include "landmark_solver.h"
#include "xray_registration/RegisterLandmarks.h"

namespace xray_registration {

/// What ~register_landmarks answers. Sets nothing, throws nothing.
RegisterLandmarks::Response landmarkAnswer(const RegisterLandmarks::Request& request, const LandmarkSolver& solver,
                                           const std::optional<VolumeGrid>& ct_grid);

}  // namespace xray_registration
