#pragma once

#include "xray_registration/image/landmark_pose.h"

namespace xray_registration {

/// Poses of the CT in the first view's camera that may be right, not refined: of each view by itself (three points of
/// four or five; RANSAC from six on), and of points that two views see.
std::vector<RigidTransform> landmarkCandidates(const std::vector<Landmark>& landmarks,
                                               const std::vector<LandmarkView>& views, double inlier_px);

}  // namespace xray_registration
