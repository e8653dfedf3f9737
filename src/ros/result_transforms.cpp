#include "xray_registration/ros/result_transforms.h"

#include <utility>

#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

geometry_msgs::TransformStamped stamped(const std_msgs::Header& parent, const std::string& child,
                                        const RigidTransform& T_parent_child) {
  geometry_msgs::TransformStamped transform;
  transform.header = parent;
  transform.child_frame_id = child;
  transform.transform = toTransform(T_parent_child);
  return transform;
}

}  // namespace

std::vector<geometry_msgs::TransformStamped> resultTransforms(const std_msgs::Header& header,
                                                              const RegistrationResult& result,
                                                              const RigidTransform& T_fixed_camera,
                                                              const FrameParameters& frames,
                                                              const std::vector<BodyParameters>& bodies) {
  std::vector<geometry_msgs::TransformStamped> transforms;
  std_msgs::Header parent = header;
  if (!frames.fixed.empty()) parent.frame_id = frames.fixed;
  if (result.accepted) {
    const RigidTransform T_parent_ct = T_fixed_camera * result.T_camera_ct;
    transforms.push_back(stamped(parent, frames.ct, frames.invert_tf ? T_parent_ct.inverse() : T_parent_ct));
    if (frames.invert_tf) std::swap(transforms.back().header.frame_id, transforms.back().child_frame_id);
  }
  for (const BodyResult& body : result.bodies) {
    if (!body.accepted) continue;
    for (const BodyParameters& known : bodies) {
      if (known.name == body.name)
        transforms.push_back(stamped(parent, known.frame, T_fixed_camera * body.T_camera_body));
    }
  }
  return transforms;
}

std::string frameProblem(const std::string& image_frame, const FrameParameters& frames,
                         const std::vector<BodyParameters>& bodies) {
  if (image_frame == frames.ct) {
    return "the image's frame_id is '" + image_frame + "', the frame of the CT (frames/ct)";
  }
  for (const BodyParameters& body : bodies) {
    if (image_frame == body.frame) {
      return "the image's frame_id is '" + image_frame + "', the frame of the body '" + body.name + "' (bodies, frame)";
    }
  }
  return "";
}

}  // namespace xray_registration
