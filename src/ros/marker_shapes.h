#pragma once

#include <visualization_msgs/InteractiveMarker.h>

#include <set>
#include <string>
#include <vector>

#include "xray_registration/pipeline/body_parameters.h"
#include "xray_registration/ros/result_listener.h"

namespace xray_registration {

/// The marker that moves what is selected: its surface, and six controls around the point that it is turned about,
/// which is the marker's origin (metres, axes of the object's frame). With the CT go the bodies of `with`, which lie in
/// it. The pose and the header are the caller's.
visualization_msgs::InteractiveMarker movableMarker(const ShownShape& selected, const std::vector<ShownShape>& with,
                                                    const std::vector<BodyParameters>& bodies);

/// Half of the longest side of a shape's box, mm; of a shape without a surface that of a hand.
double halfSizeOf(const ShownShape& shape);

/// A landmark as it is shown.
struct ShownLandmark {
  enum class State { kWaiting, kPaired, kAgrees, kLeftOut };
  Eigen::Vector3d point_ct = Eigen::Vector3d::Zero();  ///< mm
  State state = State::kWaiting;
};

/// Balls with numbers at points of the CT: yellow while they wait for their pixel, then white, green when they agree
/// with the others, red when not. Metres from `origin_ct_mm`; frame and header are the caller's.
std::vector<visualization_msgs::Marker> landmarkMarkers(const std::vector<ShownLandmark>& landmarks,
                                                        const Eigen::Vector3d& origin_ct_mm);

}  // namespace xray_registration
