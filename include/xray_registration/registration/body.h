#pragma once

#include <Eigen/Core>
#include <string>

#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// A part of the CT that moves on its own: a vertebra, a bone of a joint. Coordinates are the CT's.
struct BodyModel {
  std::string name;
  /// What the body adds to the rest's line integrals; small, since it is cut to its own box.
  AttenuationVolume volume;
  double max_rotation_rad = 0.3;                           ///< How far from where the CT has it,
  double max_translation_mm = 10.0;                        ///< of its centre.
  Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();  ///< Of what the volume shows.
};

/// Where a body is expected, against where the rest of the CT is: the identity is where the CT has it.
struct BodyStart {
  RigidTransform T_ct_body = RigidTransform::Identity();
  bool tracking = false;  ///< From an accepted neighbour, not a guess.
};

/// What was found for a body in one frame. Its pose maps the CT's coordinates, as the CT has the body, into the first
/// view's camera.
struct BodyResult {
  std::string name;
  RigidTransform T_camera_body = RigidTransform::Identity();
  bool solved = false;
  bool accepted = false;
  std::string reason;  ///< Why not accepted; empty when accepted.
  /// How well the body's own shadow is found in what the rest leaves unexplained: the correlation of X-ray and body
  /// where both are cleared of the rest (partial correlation), −1…1.
  double similarity = 0.0;
  double inlier_fraction = 0.0;  ///< Share of its shadow that correlates well.
  int iterations = 0;
  Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();  ///< What the covariance and errors are about.
  Matrix6d covariance = Matrix6d::Zero();                  ///< [mm; rad] about that centre, camera axes.
};

}  // namespace xray_registration
