#pragma once

#include <string>

#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// Where a tool that follows a session takes its start from. Never from a ground truth that nobody named: it would make
/// every result look better than it is.
struct StartSource {
  std::string file;    ///< --initial-pose
  std::string topic;   ///< --initial-pose-topic
  std::string config;  ///< --config, for the message about its initial_pose.
};

/// In the first view's camera: from the file, else the first pose on the topic, else the configuration. Without a CT it
/// is the first body's: then also from `<topic>/<body>`, which wins, and the body's own initial_pose.
/// @throws ArgumentError when there is none; std::runtime_error naming the source of one that cannot be used.
RigidTransform startPose(const StartSource& source, const BagSession& session, const NodeParameters& parameters);

/// The starts of bodies with CTs or meshes of their own, by name, in the first view's camera: the first pose on
/// `<topic>/<body>`. Those that the bag has none of are left out: the pipeline takes their initial_pose, else the CT's.
/// @throws std::runtime_error as startPose.
RegistrationPipeline::BodyPoses bodyStartPoses(const StartSource& source, const BagSession& session,
                                               const NodeParameters& parameters);

}  // namespace xray_registration::tools
