#pragma once

#include <string>
#include <vector>

namespace xray_registration::tools {

struct SessionArguments {
  std::string ct;
  std::string bag;
  std::string views;
  std::string config;
  std::string device;
  std::string initial_pose;
  std::string initial_pose_topic;
  std::vector<std::string> wrong;
  int frames = 12;
  bool write_bag = false;
  bool verbose = false;
  std::string output;  ///< Folder; made if need be.
  std::string json;    ///< Empty: none.
};

/// Calibrates the views' geometry from a session with the CT as the calibration body; prints, and writes files that ROS
/// reads.
/// @throws ArgumentError, and std::runtime_error naming the file or topic that is of no use and why.
void calibrateFromSession(const SessionArguments& arguments);

}  // namespace xray_registration::tools
