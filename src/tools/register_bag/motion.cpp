#include "tools/register_bag/motion.h"

#include <algorithm>

namespace xray_registration::tools {
namespace {

const FollowedBodyInfo& followed(const std::vector<FollowedBodyInfo>& bodies, const std::string& name) {
  return *std::find_if(bodies.begin(), bodies.end(), [&name](const auto& body) { return body.name == name; });
}

bool isMesh(const std::string& name, const NodeParameters& parameters) {
  return std::any_of(parameters.bodies.begin(), parameters.bodies.end(),
                     [&name](const BodyParameters& body) { return body.name == name && !body.mesh.empty(); });
}

TableKnee kneeOf(const RegistrationPipeline& pipeline, const std::string& text, const TableSetup& setup,
                 const Logger& logger) {
  TableKnee knee = parseKnee(text, setup.bodies);
  const std::vector<FollowedBodyInfo> bodies = pipeline.followedBodies();
  const FollowedBodyInfo& femur = followed(bodies, knee.femur);
  const FollowedBodyInfo& tibia = followed(bodies, knee.tibia);
  const bool in_one_ct = femur.cut_from_ct && tibia.cut_from_ct;
  const Eigen::Vector3d between = 0.5 * (femur.centre_mm + tibia.centre_mm);
  const auto anatomy = [&](const FollowedBodyInfo& body) {
    if (!isMesh(body.name, pipeline.parameters())) return anatomyInCt(in_one_ct ? between : body.centre_mm);
    log(logger, LogLevel::kWarning,
        "--knee: the axes of the mesh '" + body.name +
            "' are taken for x to the patient's right, y to the front, z towards the hip");
    return RigidTransform(RigidTransform::Identity());
  };
  knee.T_femur_anatomy = anatomy(femur);
  knee.T_tibia_anatomy = anatomy(tibia);
  return knee;
}

TableFrame tableFrame(const FrameRecord& record) {
  const RegistrationResult& result = record.outcome.result;
  TableFrame frame;
  frame.stamp_s = record.stamp.toSec();
  frame.T_camera_ct = result.T_camera_ct;
  frame.accepted = result.accepted;
  for (const BodyResult& body : result.bodies) {
    frame.bodies.push_back({body.name, body.T_camera_body, body.accepted, body.solved});
  }
  return frame;
}

}  // namespace

TableSetup tableSetup(const RegistrationPipeline& pipeline, const std::string& knee, const Logger& logger) {
  TableSetup setup;
  for (const FollowedBodyInfo& body : pipeline.followedBodies()) setup.bodies.push_back({body.name, body.centre_mm});
  // Without the rest, the first body stands for the CT.
  const NodeParameters& parameters = pipeline.parameters();
  setup.has_ct = !parameters.ct.path.empty() && (parameters.ct.rest || parameters.bodies.empty());
  if (!knee.empty()) setup.knee = kneeOf(pipeline, knee, setup, logger);
  return setup;
}

std::vector<TableFrame> tableFrames(const std::vector<FrameRecord>& records) {
  std::vector<TableFrame> frames;
  frames.reserve(records.size());
  for (const FrameRecord& record : records) frames.push_back(tableFrame(record));
  return frames;
}

}  // namespace xray_registration::tools
