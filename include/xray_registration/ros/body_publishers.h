#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <std_msgs/Header.h>

#include <string>
#include <vector>

#include "xray_registration/pipeline/body_parameters.h"
#include "xray_registration/registration/body.h"
#include "xray_registration/volume/bone_surface.h"

namespace xray_registration {

/// ~bodies/<name>/…: what is published of each body. Thread-safe as ros::Publisher is.
class BodyPublishers {
 public:
  BodyPublishers(ros::NodeHandle private_node, const std::vector<BodyParameters>& bodies);

  /// The accepted ones' poses.
  void poses(const std_msgs::Header& header, const std::vector<BodyResult>& results) const;

  /// In the body's frame, latched. A topic for each body: a latched topic keeps its last marker alone. Nothing for a
  /// name that is not configured.
  void surface(const std::string& name, const TriangleMesh& mesh) const;

 private:
  struct Body {
    BodyParameters parameters;
    ros::Publisher pose;
    ros::Publisher surface;
  };
  const Body* named(const std::string& name) const;

  std::vector<Body> bodies_;
};

}  // namespace xray_registration
