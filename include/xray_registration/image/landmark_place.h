#pragma once

#include <string>
#include <vector>

#include "xray_registration/geometry/volume_grid.h"
#include "xray_registration/image/landmark_pose.h"

namespace xray_registration {

/// Why landmarks cannot be points of a CT on this grid: one lies outside of it by more than a centimetre (markers on
/// the skin lie on its rim). Says so when all would lie in it had they been meant as RAS, or a thousand times smaller.
/// Empty when they can; numbers that are not finite are not looked at.
std::string outsideOfCt(const std::vector<Landmark>& landmarks, const VolumeGrid& grid);

}  // namespace xray_registration
