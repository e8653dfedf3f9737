#pragma once

#include "xray_registration/image/landmark_pose.h"

namespace xray_registration {

/// Distance in its view between where the pose has a landmark and its pixel; infinite behind the source.
double landmarkResidual(const Landmark& landmark, const std::vector<LandmarkView>& views,
                        const RigidTransform& T_first_ct);

/// Least squares over the chosen landmarks of all views (Levenberg-Marquardt), from a pose that is near.
RigidTransform refinedPose(const std::vector<Landmark>& landmarks, const std::vector<bool>& chosen,
                           const std::vector<LandmarkView>& views, RigidTransform T_first_ct);

}  // namespace xray_registration
