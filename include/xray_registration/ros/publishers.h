#pragma once

#include <image_transport/image_transport.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <tf2_ros/transform_broadcaster.h>

#include <string>
#include <vector>

#include "xray_registration/RegistrationStatus.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/ros/body_publishers.h"
#include "xray_registration/volume/bone_surface.h"

namespace xray_registration {

/// Everything that the node publishes except diagnostics. Publishing is thread-safe as ros::Publisher is, but for
/// sendResult, which belongs to the worker.
class Publishers {
 public:
  Publishers(ros::NodeHandle private_node, const NodeParameters& parameters);

  void status(const RegistrationStatus& message) const { status_.publish(message); }

  /// tf, ~pose and the bodies' poses of what was accepted in a frame. `T_fixed_camera` is needed when frames/fixed is
  /// set. Never sends tf twice with one stamp, nor with an older one.
  void sendResult(const std_msgs::Header& header, const RegistrationResult& result, const Eigen::Vector3d& centre_ct_mm,
                  const RigidTransform& T_fixed_camera);
  /// After a time jump stamps start again.
  void forgetStamps() { last_tf_stamp_ = ros::Time(); }

  bool wantsDrr(std::size_t view) const { return drr_[view].getNumSubscribers() > 0; }
  bool wantsOverlay(std::size_t view) const { return overlay_[view].getNumSubscribers() > 0; }
  void drr(std::size_t view, const std_msgs::Header& header, const FloatImage& drr) const;
  void overlay(std::size_t view, const std_msgs::Header& header, const XrayFrame& xray,
               const std::vector<OverlayLine>& lines) const;
  /// Of the body of this name; of the CT without one.
  void surface(const std::string& body, const TriangleMesh& mesh) const;

 private:
  FrameParameters frames_;
  std::vector<BodyParameters> body_parameters_;
  std::string drr_encoding_;
  ros::Publisher status_;
  ros::Publisher pose_;
  ros::Publisher surface_;
  std::vector<image_transport::Publisher> drr_;
  std::vector<image_transport::Publisher> overlay_;
  BodyPublishers bodies_;
  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Time last_tf_stamp_;
};

}  // namespace xray_registration
