#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace xray_registration {

/// Rotations spread evenly over all that there are, neighbours about `spacing_rad` apart (super-Fibonacci spiral,
/// M. Alexa, "Super-Fibonacci Spirals", CVPR 2022): the same everywhere.
std::vector<Eigen::Matrix3d> evenRotations(double spacing_rad);

/// Orientations R_camera_ct within an angle of one; that one first.
std::vector<Eigen::Matrix3d> orientationsAround(const Eigen::Matrix3d& R_camera_ct, double rotation_rad,
                                                double spacing_rad);

/// Orientations R_camera_ct in which a patient is usually seen (CT axes as in DICOM): from all sides, with the beam
/// within 40° of the axial plane, and the head within 45° of up or down in the image. The standard views (ap, pa,
/// laterals, obliques at 45°, head up and down) come first.
std::vector<Eigen::Matrix3d> usualOrientations(double spacing_rad);

}  // namespace xray_registration
