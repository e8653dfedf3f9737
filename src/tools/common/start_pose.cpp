#include "tools/common/start_pose.h"

#include <optional>
#include <stdexcept>

#include "tools/common/command_line.h"
#include "tools/common/yaml_files.h"

namespace xray_registration::tools {
namespace {

/// A pose given in the frame of one of the views, carried to the first.
RigidTransform inFirstView(const BagSession& session, const std::string& frame_id, const RigidTransform& T_frame_ct,
                           const std::string& source) {
  std::string known;
  for (const auto& view : session.views()) {
    if (frame_id.empty() || frame_id == view.frame_id) return view.T_view_first.inverse() * T_frame_ct;
    known += (known.empty() ? "" : ", ") + view.frame_id;
  }
  throw std::runtime_error(source + ": the pose is in frame '" + frame_id + "', which is none of the views' (" + known +
                           ")");
}

/// The first pose on a topic.
RigidTransform recordedPose(const BagSession& session, const std::string& topic, const std::string& frame) {
  const StampedPose pose = readPoses(session.path(), topic, frame, 1).front();
  return inFirstView(session, pose.frame_id, pose.T_frame_ct, topic);
}

/// The pose of a body beside the CT's, if it was recorded.
std::optional<RigidTransform> recordedPoseOf(const BodyParameters& body, const StartSource& source,
                                             const BagSession& session) {
  const std::string topic = source.topic + "/" + body.name;
  if (source.topic.empty() || !hasTopic(session.path(), topic)) return std::nullopt;
  return recordedPose(session, topic, body.frame);
}

}  // namespace

RigidTransform startPose(const StartSource& source, const BagSession& session, const NodeParameters& parameters) {
  if (!source.file.empty()) return readPoseFile(source.file);
  const bool is_bodys = parameters.ct.path.empty() && !parameters.needsCt();
  if (is_bodys) {
    if (const auto recorded = recordedPoseOf(parameters.bodies.front(), source, session)) return *recorded;
  }
  if (!source.topic.empty()) return recordedPose(session, source.topic, parameters.frames.ct);
  if (is_bodys && parameters.bodies.front().initial_pose) return *parameters.bodies.front().initial_pose;
  if (parameters.initial_pose) {
    return inFirstView(session, parameters.initial_pose_frame, *parameters.initial_pose, source.config);
  }
  throw ArgumentError("no start: give --initial-pose, --initial-pose-topic, or initial_pose in --config");
}

RegistrationPipeline::BodyPoses bodyStartPoses(const StartSource& source, const BagSession& session,
                                               const NodeParameters& parameters) {
  RegistrationPipeline::BodyPoses poses;
  for (const BodyParameters& body : parameters.bodies) {
    if (body.isCutFromCt()) continue;
    if (const auto recorded = recordedPoseOf(body, source, session)) poses[body.name] = *recorded;
  }
  return poses;
}

}  // namespace xray_registration::tools
