#include "xray_registration/ros/publishers.h"

#include <geometry_msgs/PoseWithCovarianceStamped.h>

#include "xray_registration/ros/conversions.h"
#include "xray_registration/ros/result_transforms.h"
#include "xray_registration/ros/surface_marker.h"

namespace xray_registration {

Publishers::Publishers(ros::NodeHandle private_node, const NodeParameters& parameters)
    : frames_(parameters.frames),
      body_parameters_(parameters.bodies),
      drr_encoding_(parameters.drr_encoding),
      bodies_(private_node, parameters.bodies) {
  // A status is small, and every frame has one: a burst of frames that come faster than the network thread writes (one
  // of 150 lost statuses in a queue of 100) is told in full.
  status_ = private_node.advertise<RegistrationStatus>("status", 1000);
  pose_ = private_node.advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", 10);
  surface_ = private_node.advertise<visualization_msgs::Marker>("ct_surface", 1, true);
  image_transport::ImageTransport transport(private_node);
  for (const std::string& view : parameters.viewNames()) {
    const std::string prefix = view.empty() ? "" : view + "/";
    drr_.push_back(transport.advertise(prefix + "drr", 1));
    overlay_.push_back(transport.advertise(prefix + "overlay", 1));
  }
}

void Publishers::sendResult(const std_msgs::Header& header, const RegistrationResult& result,
                            const Eigen::Vector3d& centre_ct_mm, const RigidTransform& T_fixed_camera) {
  const std::vector<geometry_msgs::TransformStamped> transforms =
      resultTransforms(header, result, T_fixed_camera, frames_, body_parameters_);
  if (frames_.publish_tf && !transforms.empty() && header.stamp > last_tf_stamp_) {
    last_tf_stamp_ = header.stamp;
    broadcaster_.sendTransform(transforms);
  }
  bodies_.poses(header, result.bodies);
  if (!result.accepted) return;
  geometry_msgs::PoseWithCovarianceStamped pose;
  pose.header = header;
  pose.pose = toPoseWithCovariance(result.T_camera_ct, result.covariance, centre_ct_mm);
  pose_.publish(pose);
}

void Publishers::drr(std::size_t view, const std_msgs::Header& header, const FloatImage& drr) const {
  sensor_msgs::Image message = drr_encoding_ == "32FC1" ? toFloatMessage(drr) : toDisplayMessage(drr);
  message.header = header;
  drr_[view].publish(message);
}

void Publishers::overlay(std::size_t view, const std_msgs::Header& header, const XrayFrame& xray,
                         const std::vector<OverlayLine>& lines) const {
  sensor_msgs::Image message = toColourMessage(drawOverlay(xray.attenuation.values(), xray.mask, lines));
  message.header = header;
  overlay_[view].publish(message);
}

void Publishers::surface(const std::string& body, const TriangleMesh& mesh) const {
  if (!body.empty()) return bodies_.surface(body, mesh);
  surface_.publish(toMarker(mesh, frames_.ct));
}

}  // namespace xray_registration
