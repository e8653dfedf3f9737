#include "tools/common/session_messages.h"

#include <sensor_msgs/image_encodings.h>

#include <cstring>

namespace xray_registration::tools {

std::vector<BagView> bagViews(const SessionGenerator& generator) {
  std::vector<BagView> views;
  for (std::size_t i = 0; i < generator.setup().views.size(); ++i) {
    const std::string& name = generator.setup().views[i].name;
    views.push_back({name, name + "_xray_optical", generator.viewFromFirst(i)});
  }
  return views;
}

sensor_msgs::Image imageMessage(const Image<std::uint16_t>& image, const std::string& frame_id,
                                const ros::Time& stamp) {
  sensor_msgs::Image message;
  message.header.frame_id = frame_id;
  message.header.stamp = stamp;
  message.width = static_cast<std::uint32_t>(image.width);
  message.height = static_cast<std::uint32_t>(image.height);
  message.encoding = sensor_msgs::image_encodings::MONO16;
  message.is_bigendian = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__;
  message.step = message.width * 2;
  message.data.resize(image.pixels.size() * 2);
  std::memcpy(message.data.data(), image.pixels.data(), message.data.size());
  return message;
}

sensor_msgs::CameraInfo cameraInfoMessage(const XrayCamera& camera, const std::string& frame_id,
                                          const ros::Time& stamp) {
  sensor_msgs::CameraInfo message;
  message.header.frame_id = frame_id;
  message.header.stamp = stamp;
  message.width = static_cast<std::uint32_t>(camera.width);
  message.height = static_cast<std::uint32_t>(camera.height);
  message.distortion_model = "plumb_bob";
  message.D.assign(5, 0.0);
  message.K = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  message.R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  message.P = {camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0};
  return message;
}

}  // namespace xray_registration::tools
