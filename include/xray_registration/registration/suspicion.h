#pragma once

#include <string>

namespace xray_registration {

/// Something that may have been told wrongly, as the X-rays see it: an estimate of by how much, and what the error does
/// to the pose.
struct SetupSuspicion {
  std::string what;        ///< focal_length, principal_point, distortion, view_pose, ct_scale, mirrored_image, …
  std::string in_words;    ///< "the pose of the view 'oblique' (rotation)"
  double estimate = 0.0;   ///< How much it looks off; a length where it has several components.
  double sigma = 0.0;      ///< Standard deviation of the estimate.
  std::string unit;        ///< %, px, degrees, mm; empty for a discrete one.
  double effect_mm = 0.0;  ///< How far it moves points around the CT's centre.
  bool certain = false;    ///< The estimate is many σ from zero.
};

}  // namespace xray_registration
