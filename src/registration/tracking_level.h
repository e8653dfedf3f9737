#pragma once

#include "registration/frame_objective.h"

namespace xray_registration {

/// σ of motion in the image that a covariance [mm; rad] about the CT's centre leaves, mm at the CT: root mean square
/// over points kTargetRadiusMm from the centre, both axes together.
double inPlaneSigma(const Matrix6d& covariance, const RigidTransform& T_camera_ct);

/// How many levels coarser than the finest a tracked frame may end: as many as leave the pose's in-plane σ, as this
/// X-ray's own windows tell it at the solution, within `precision_mm`. What is finer only costs time. Zero where the
/// finest level itself is not that certain, and where precision_mm is 0.
int levelsToSpare(FrameObjective* objective, const Solution& solution, double precision_mm);

}  // namespace xray_registration
