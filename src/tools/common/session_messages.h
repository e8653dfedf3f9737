#pragma once

#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <string>
#include <vector>

#include "tools/common/session_generator.h"
#include "xray_registration/ros/bag_session.h"

namespace xray_registration::tools {

/// The generator's views with their frames, <view>_xray_optical.
std::vector<BagView> bagViews(const SessionGenerator& generator);

/// As mono16.
sensor_msgs::Image imageMessage(const Image<std::uint16_t>& image, const std::string& frame_id, const ros::Time& stamp);

sensor_msgs::CameraInfo cameraInfoMessage(const XrayCamera& camera, const std::string& frame_id,
                                          const ros::Time& stamp);

}  // namespace xray_registration::tools
