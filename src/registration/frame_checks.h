#pragma once

#include <string>
#include <vector>

#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// What is wrong with a view in itself, in words; empty when nothing is.
std::string problemOf(const XrayFrame& view);

/// What keeps a frame from being registered, in words; empty when nothing does.
std::string problemOf(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start);

/// Largest over smallest eigenvalue of a normal matrix for twists [mm; rad], rotation as motion at `radius_mm`; at most
/// 1e30, since JSON and messages carry no infinity.
double conditionNumber(const Matrix6d& normal, double radius_mm);

/// The matrix in units of motion at `radius_mm`: rows and columns of rotation divided by it.
Matrix6d scaledToRadius(const Matrix6d& matrix, double radius_mm);

}  // namespace xray_registration
