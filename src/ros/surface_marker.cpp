#include "xray_registration/ros/surface_marker.h"

namespace xray_registration {

visualization_msgs::Marker toMarker(const TriangleMesh& mesh, const std::string& frame_id,
                                    const std::string& name_space, const Rgb& colour) {
  visualization_msgs::Marker marker;
  marker.header.frame_id = frame_id;
  marker.ns = name_space;
  marker.type = visualization_msgs::Marker::TRIANGLE_LIST;
  marker.action = mesh.triangles.empty() ? visualization_msgs::Marker::DELETE : visualization_msgs::Marker::ADD;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
  marker.color.r = static_cast<float>(colour[0]) / 255.0F;
  marker.color.g = static_cast<float>(colour[1]) / 255.0F;
  marker.color.b = static_cast<float>(colour[2]) / 255.0F;
  marker.color.a = 1.0F;
  marker.frame_locked = 1;  // The bones follow the newest transform.
  marker.points.reserve(mesh.triangles.size() * 3);
  for (const auto& triangle : mesh.triangles) {
    for (const int corner : triangle) {
      const Eigen::Vector3f& vertex = mesh.vertices_ct_mm[static_cast<std::size_t>(corner)];
      geometry_msgs::Point point;
      point.x = vertex.x() * 1e-3;
      point.y = vertex.y() * 1e-3;
      point.z = vertex.z() * 1e-3;
      marker.points.push_back(point);
    }
  }
  return marker;
}

}  // namespace xray_registration
