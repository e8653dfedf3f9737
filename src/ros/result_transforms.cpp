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

namespace {

/// "the frame of the CT (frames/ct)", of a frame that the registration places; empty for any other.
std::string placedFrame(const std::string& frame_id, const FrameParameters& frames,
                        const std::vector<BodyParameters>& bodies) {
  if (frame_id == frames.ct) return "the frame of the CT (frames/ct)";
  for (const BodyParameters& body : bodies) {
    if (frame_id == body.frame) return "the frame of the body '" + body.name + "' (bodies, frame)";
  }
  return "";
}

}  // namespace

std::string frameProblem(const std::string& image_frame, const FrameParameters& frames,
                         const std::vector<BodyParameters>& bodies) {
  if (image_frame.empty()) return "the image has no frame_id";
  const std::string placed = placedFrame(image_frame, frames, bodies);
  return placed.empty() ? "" : "the image's frame_id is '" + image_frame + "', " + placed;
}

std::string frameChangeProblem(const std::string& image_frame, const std::string& until_now,
                               const FrameParameters& frames) {
  if (until_now.empty() || image_frame == until_now || frames.allow_change) return "";
  std::string problem = "the image's frame_id is '";
  problem.append(image_frame)
      .append("', and was '")
      .append(until_now)
      .append("': the CT would have two parents in tf; ");
  return problem + "call ~reset when this is another camera, or set frames/allow_change";
}

std::string startFrameProblem(const std::string& frame_id, const FrameParameters& frames,
                              const std::vector<BodyParameters>& bodies) {
  const std::string placed = placedFrame(frame_id, frames, bodies);
  if (placed.empty()) return "";
  return "header.frame_id is '" + frame_id + "', " + placed +
         ", which the registration is to place; give the pose in the X-ray's optical frame, or one that tf connects to "
         "it";
}

}  // namespace xray_registration
