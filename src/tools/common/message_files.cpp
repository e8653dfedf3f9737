#include "tools/common/message_files.h"

#include <sensor_msgs/image_encodings.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "tools/common/image_files.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration::tools {

void writePng(const std::string& path, const sensor_msgs::Image& message) {
  if (message.encoding != sensor_msgs::image_encodings::RGB8) {
    writeGreyPng(path, floatsOf(rawImage(message).pixels));
    return;
  }
  // OpenCV's type for pixels in memory has no read-only form.
  const cv::Mat rgb(static_cast<int>(message.height), static_cast<int>(message.width), CV_8UC3,
                    const_cast<std::uint8_t*>(message.data.data()), message.step);
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  if (!cv::imwrite(path, bgr)) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace xray_registration::tools
