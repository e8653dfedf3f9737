#include "tools/common/start_pose.h"

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

}  // namespace

RigidTransform startPose(const StartSource& source, const BagSession& session, const NodeParameters& parameters) {
  if (!source.file.empty()) return readPoseFile(source.file);
  if (!source.topic.empty()) {
    const StampedPose pose = readPoses(session.path(), source.topic, parameters.frames.ct, 1).front();
    return inFirstView(session, pose.frame_id, pose.T_frame_ct, source.topic);
  }
  if (parameters.initial_pose) {
    return inFirstView(session, parameters.initial_pose_frame, *parameters.initial_pose, source.config);
  }
  throw ArgumentError("no start: give --initial-pose, --initial-pose-topic, or initial_pose in --config");
}

}  // namespace xray_registration::tools
