#pragma once

#include "registration/body_objective.h"
#include "registration/cold_start.h"
#include "xray_registration/registration/body.h"

namespace xray_registration {

/// What was found for a body, and the best that was found at another place.
struct BodySolution {
  Solution solution;
  Rival rival;
};

/// Searches within the body's range around `T_camera_neutral`, where the CT has it, and from `start`, and descends to
/// the finest level.
BodySolution searchBody(BodyObjective* objective, const RigidTransform& T_camera_neutral, const RigidTransform& start);

/// Descends from a prediction.
Solution trackBody(BodyObjective* objective, const RigidTransform& start);

/// Goes on from a solution on the finest level, where its surroundings moved.
Solution refineBody(BodyObjective* objective, const RigidTransform& start);

}  // namespace xray_registration
