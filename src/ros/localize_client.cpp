#include "localize_client.h"

#include <ros/console.h>

#include <cmath>

#include "xray_registration/LocalizeActionGoal.h"
#include "xray_registration/LocalizeActionResult.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

// How far a hand in rviz, or a guess, is off.
constexpr double kRotation_rad = M_PI / 3.0;
constexpr double kTranslation_m = 0.1;

}  // namespace

LocalizeClient::LocalizeClient(ros::NodeHandle private_node)
    : goals_(private_node.advertise<LocalizeActionGoal>("localize/goal", 2)),
      results_(private_node.subscribe<LocalizeActionResult>(
          "localize/result", 2, [this](const LocalizeActionResultConstPtr& result) {
            if (result->status.goal_id.id != last_id_) return;
            ROS_INFO_STREAM("~localize " << (result->result.success != 0 ? "succeeded" : "did not succeed") << ": "
                                         << result->result.message);
          })) {}

bool LocalizeClient::start(const std::optional<RigidTransform>& T_frame_ct, const std::string& frame_id) {
  if (goals_.getNumSubscribers() == 0) {
    ROS_WARN("~ct_marker: the wide search ~localize is not available");
    return false;
  }
  LocalizeActionGoal message;
  message.header.stamp = message.goal_id.stamp = ros::Time::now();
  last_id_ = goals_.getTopic() + " by hand, number " + std::to_string(++sent_);
  message.goal_id.id = last_id_;
  message.goal.rotation = kRotation_rad;
  message.goal.translation = kTranslation_m;
  message.goal.centre.pose.orientation.w = 1.0;
  if (T_frame_ct) {
    message.goal.centre.header.frame_id = frame_id;
    message.goal.centre.pose = toPose(*T_frame_ct);
  }
  ROS_INFO_STREAM("~ct_marker: ~localize " << (T_frame_ct ? "around the marker" : "from nothing"));
  goals_.publish(message);
  return true;
}

}  // namespace xray_registration
