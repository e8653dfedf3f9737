#pragma once

#include <visualization_msgs/Marker.h>

#include <string>

#include "xray_registration/pipeline/overlay.h"
#include "xray_registration/volume/bone_surface.h"

namespace xray_registration {

constexpr Rgb kBoneColour = {237, 227, 199};

/// A mesh as TRIANGLE_LIST in frame `frame_id`, metres. An empty mesh gives action DELETE.
visualization_msgs::Marker toMarker(const TriangleMesh& mesh, const std::string& frame_id,
                                    const std::string& name_space = "ct_surface", const Rgb& colour = kBoneColour);

}  // namespace xray_registration
