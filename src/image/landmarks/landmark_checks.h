#pragma once

#include "xray_registration/image/landmark_pose.h"

namespace xray_registration {

/// "'orbita left'", or "number 3" for one without a name.
std::string nameOf(const std::vector<Landmark>& landmarks, std::size_t index);

/// @throws std::invalid_argument, LandmarkError when no pose can come of the points, whatever their pixels.
void checkLandmarks(const std::vector<Landmark>& landmarks, const std::vector<LandmarkView>& views);

/// Whether points lie on a line, as far as a pose is concerned.
bool areCollinear(const std::vector<Eigen::Vector3d>& points);

}  // namespace xray_registration
