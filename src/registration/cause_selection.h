#pragma once

#include "registration/joint_solver.h"

namespace xray_registration {

/// The same parameters of all views in one group.
CalibratedGroup commonOf(const CalibratedGroups& groups);

/// What of a geometry has to be freed to explain the X-rays: the simplest set of groups, found by adding one cause
/// after the other.
///
/// Much of a geometry imitates each other: a principal point and a turn of the view's pose, all focal lengths together
/// and distances. Freeing all of it lets a CT's own errors move what was right. So a cause is added only when it
/// explains the X-rays better by more than chance, and of causes that explain nearly as much the simplest is taken: the
/// same error in all views, which one device took, before one of a view alone.
/// @param single  The groups of the views one by one; distortion is never chosen.
/// @param as_told  Poses solved for with the geometry as told.
CalibratedGroups selectCauses(JointFrames* frames, const CalibratedGroups& single, const JointSetup& as_told);

}  // namespace xray_registration
