#pragma once

#include <string>

#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/xray_frame.h"

namespace xray_registration::tools {

/// Reads an X-ray camera from YAML: ROS's camera_calibration form (image_width, image_height, camera_matrix), or the
/// short form (width, height and either fx, fy, cx, cy or source_detector_mm, pixel_mm). docs/formats.md has both.
/// @throws std::runtime_error naming the file, the key and what is wrong; lens distortion is refused.
XrayCamera readCameraFile(const std::string& path);

/// Writes ROS's camera_calibration form, which camera_info_manager reads.
void writeCameraFile(const std::string& path, const std::string& camera_name, const XrayCamera& camera);
/// The same with a lens, of the whole unbinned sensor.
void writeCameraFile(const std::string& path, const std::string& camera_name, const Calibration& calibration);

/// Reads a pose of the CT in the X-ray optical frame from YAML: position (metres) and orientation (x, y, z, w), or
/// T_camera_ct_mm (4×4, mm); either may stand under `initial_pose`, as in the node's configuration.
/// @throws std::runtime_error naming the file, the key and what is wrong.
RigidTransform readPoseFile(const std::string& path);

/// Writes position and orientation.
void writePoseFile(const std::string& path, const RigidTransform& T_camera_ct);

}  // namespace xray_registration::tools
