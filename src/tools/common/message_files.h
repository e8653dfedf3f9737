#pragma once

#include <sensor_msgs/Image.h>

#include <string>

namespace xray_registration::tools {

/// A PNG for the eyes: rgb8 as it is, single-channel images from black to white over their range.
/// @throws std::runtime_error naming the file when it cannot be written; FrameError for another encoding.
void writePng(const std::string& path, const sensor_msgs::Image& message);

}  // namespace xray_registration::tools
