#pragma once

#include <ros/time.h>

#include <map>
#include <optional>
#include <string>

#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/pipeline/registration_pipeline.h"

namespace xray_registration::tools {

/// What is known about one frame at the end.
struct FrameRecord {
  ros::Time stamp;
  ros::Time received;
  std::string frame_id;  ///< Of the first view, where its results stand.
  FrameOutcome outcome;
  std::optional<PoseError> error;                ///< Where the bag has the true pose.
  std::map<std::string, PoseError> body_errors;  ///< The same of bodies, by name; targets about the body's centre.
};

}  // namespace xray_registration::tools
