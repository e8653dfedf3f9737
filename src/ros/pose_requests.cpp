#include "xray_registration/ros/pose_requests.h"

#include <iterator>

namespace xray_registration {

std::optional<RigidTransform> PoseRequests::inCamera(const PoseRequest& request, const std_msgs::Header& header,
                                                     std::string* why) const {
  if (request.frame_id.empty()) return request.T_frame_object;
  const std::optional<RigidTransform> T_camera_frame =
      transforms_->lookup(header.frame_id, request.frame_id, header.stamp, tf_timeout_s_, why);
  if (!T_camera_frame) return std::nullopt;
  return RigidTransform(*T_camera_frame * request.T_frame_object);
}

std::string PoseRequests::handOn(const std_msgs::Header& header, RegistrationPipeline* pipeline,
                                 std::string* body_problem) {
  for (auto request = requests_.begin(); request != requests_.end();) {
    const std::string& body = request->first;
    std::string why;
    const std::optional<RigidTransform> T_camera_object = inCamera(request->second, header, &why);
    bool used = false;
    if (!T_camera_object) {
      if (body.empty()) return "the initial pose cannot be used: " + why;
      *body_problem = "the initial pose of '";
      body_problem->append(body).append("' cannot be used: ").append(why);
    } else if (body.empty()) {
      pipeline->setPose(*T_camera_object);
      used = true;
    } else {
      used = pipeline->setBodyPose(body, *T_camera_object, header.stamp.toSec());
    }
    request = used ? requests_.erase(request) : std::next(request);
  }
  return "";
}

}  // namespace xray_registration
