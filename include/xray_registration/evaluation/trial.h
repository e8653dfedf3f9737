#pragma once

#include <vector>

#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// What became of a body that moves on its own; errors are those of targets about its own centre.
struct BodyTrial {
  BodyResult result;
  PoseError start;
  PoseError final;
  double final_rotation_rad = 0.0;  ///< Angle between what was found and the truth.
};

/// One registration whose truth is known.
struct Trial {
  int frame = 0;  ///< EvaluationFrame::index.
  double stamp_s = 0.0;
  Twist disturbance = Twist::Zero();  ///< Start against truth, about the centre of the targets.
  PoseError start;
  PoseError final;
  RegistrationResult result;      ///< Its pose is the start where nothing was found.
  std::vector<BodyTrial> bodies;  ///< Those whose truth is known.
  double prepare_ms = 0.0;        ///< From the images in memory: linearised, undistorted, masked.
  double solve_ms = 0.0;          ///< Wall clock of the registration, uploads of images and verdict included.
  int frames_to_find = 1;         ///< Offered until this one; more than 1 only where the CT was lost on purpose.
};

}  // namespace xray_registration
