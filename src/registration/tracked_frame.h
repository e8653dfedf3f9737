#pragma once

#include "registration/frame_objective.h"

namespace xray_registration {

/// A tracked frame's objective. Above the finest level the solve ends with a step that is short for what follows it,
/// and takes it untested.
class TrackedObjective : public FrameObjective {
 public:
  using FrameObjective::FrameObjective;
  GaussNewtonOptions solverFor(const Stage& stage, const RigidTransform& start) const override;
};

/// Registers a frame whose start is the prediction from an accepted neighbour: the level below the finest, then the
/// finest on the tiles in which the X-ray varies most, with one or two evaluations.
Solution trackFrame(FrameObjective* objective, const ColdStart& found, const RigidTransform& start);

}  // namespace xray_registration
