#pragma once

#include <visualization_msgs/Marker.h>

#include <string>

#include "xray_registration/volume/bone_surface.h"

namespace xray_registration {

/// A mesh as TRIANGLE_LIST in frame `frame_id`, metres, bone-coloured. An empty mesh gives action DELETE.
visualization_msgs::Marker toMarker(const TriangleMesh& mesh, const std::string& frame_id);

}  // namespace xray_registration
