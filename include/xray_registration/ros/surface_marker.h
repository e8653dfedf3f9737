#pragma once

#include <visualization_msgs/Marker.h>

#include <string>

#include "xray_registration/volume/bone_surface.h"
#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// A CT averaged over whole blocks until it has no more than `max_voxels`: enough for a picture of its bones, and a
/// bound on the time that the picture takes.
Volume reducedForDisplay(const Volume& ct, std::size_t max_voxels);

/// A mesh as TRIANGLE_LIST in frame `frame_id`, metres, bone-coloured. An empty mesh gives action DELETE.
visualization_msgs::Marker toMarker(const TriangleMesh& mesh, const std::string& frame_id);

}  // namespace xray_registration
