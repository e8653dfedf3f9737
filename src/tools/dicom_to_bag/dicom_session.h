#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "tools/dicom_to_bag/dicom_views.h"

namespace xray_registration::tools {

/// What was written.
struct WrittenSession {
  std::string config;                        ///< Parameters for the node and the tools, YAML.
  std::optional<RigidTransform> T_first_ct;  ///< In the first view's camera.
  bool views_are_connected = true;           ///< Whether /tf_static has the views' relative poses.
};

/// Writes the views as a session (docs/formats.md): images, camera_info, the first pose on /initialpose, each picture's
/// pose on /<view>/positioner_pose, the relative poses that the positioner's angles give on /tf_static; beside the bag
/// the masks, <bag>_<view>_mask.png, and <bag>.yaml with the parameters that go with it.
/// @param isocentre_ct_mm  Where the CT has the isocentre.
/// @throws BagSessionError, std::runtime_error when a file cannot be written.
WrittenSession writeDicomSession(const std::string& bag, const std::vector<DicomView>& views,
                                 const Eigen::Vector3d& isocentre_ct_mm, double first_stamp_s);

}  // namespace xray_registration::tools
