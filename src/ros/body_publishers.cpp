#include "xray_registration/ros/body_publishers.h"

#include <geometry_msgs/PoseWithCovarianceStamped.h>

#include <algorithm>

#include "xray_registration/ros/conversions.h"
#include "xray_registration/ros/surface_marker.h"

namespace xray_registration {

BodyPublishers::BodyPublishers(ros::NodeHandle private_node, const std::vector<BodyParameters>& bodies) {
  for (const BodyParameters& parameters : bodies) {
    const std::string prefix = "bodies/" + parameters.name + "/";
    bodies_.push_back({parameters,
                       private_node.advertise<geometry_msgs::PoseWithCovarianceStamped>(prefix + "pose", 10),
                       private_node.advertise<visualization_msgs::Marker>(prefix + "surface", 1, true)});
  }
}

const BodyPublishers::Body* BodyPublishers::named(const std::string& name) const {
  const auto found =
      std::find_if(bodies_.begin(), bodies_.end(), [&](const Body& body) { return body.parameters.name == name; });
  return found == bodies_.end() ? nullptr : &*found;
}

void BodyPublishers::poses(const std_msgs::Header& header, const std::vector<BodyResult>& results) const {
  for (const BodyResult& result : results) {
    const Body* body = named(result.name);
    if (body == nullptr || !result.accepted) continue;
    geometry_msgs::PoseWithCovarianceStamped pose;
    pose.header = header;
    pose.pose = toPoseWithCovariance(result.T_camera_body, result.covariance, result.centre_ct_mm);
    body->pose.publish(pose);
  }
}

void BodyPublishers::surface(const std::string& name, const TriangleMesh& mesh) const {
  const Body* body = named(name);
  if (body == nullptr) return;
  const Rgb colour = bodyColour(static_cast<std::size_t>(body - bodies_.data()));
  body->surface.publish(toMarker(mesh, body->parameters.frame, "bodies/" + name, colour));
}

}  // namespace xray_registration
