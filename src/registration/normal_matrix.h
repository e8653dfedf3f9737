#pragma once

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// Largest over smallest eigenvalue of a normal matrix for twists [mm; rad], rotation as motion at `radius_mm`; at most
/// 1e30, since JSON and messages carry no infinity.
double conditionNumber(const Matrix6d& normal, double radius_mm);

/// The matrix in units of motion at `radius_mm`: rows and columns of rotation divided by it.
Matrix6d scaledToRadius(const Matrix6d& matrix, double radius_mm);

}  // namespace xray_registration
