#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>

#include <optional>
#include <string>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// Starts the wide search ~localize, whoever serves it, and logs what comes of it. Speaks the action's topics itself:
/// actionlib's client does not find a server that stands in the same process. One thread: that of the handle's queue.
class LocalizeClient {
 public:
  /// `private_node`: the node's own, with the queue that answers come through.
  explicit LocalizeClient(ros::NodeHandle private_node);

  /// Around a pose of the CT in `frame_id`; from nothing without one. False, and said in the log, when nobody serves
  /// the action.
  bool start(const std::optional<RigidTransform>& T_frame_ct, const std::string& frame_id);

 private:
  ros::Publisher goals_;
  ros::Subscriber results_;
  std::string last_id_;  ///< Of the goal that was sent last; others are not this one's.
  int sent_ = 0;
};

}  // namespace xray_registration
