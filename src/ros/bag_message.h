#pragma once

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <rosbag/message_instance.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <tf2_msgs/TFMessage.h>

#include <boost/make_shared.hpp>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace xray_registration {

/// How a message is serialised, as far as lengths go: 'h' a header, 's' a text, 'b' a list of bytes, 'd' one of
/// doubles, 't' one of transforms, '8', '5': so many bytes. What follows the last list is left out.
template <typename Message>
const char* messageLayout();
template <>
inline const char* messageLayout<sensor_msgs::Image>() {
  return "h8s5b";
}
template <>
inline const char* messageLayout<sensor_msgs::CameraInfo>() {
  return "h8sd";
}
template <>
inline const char* messageLayout<geometry_msgs::PoseStamped>() {
  return "h";
}
template <>
inline const char* messageLayout<geometry_msgs::PoseWithCovarianceStamped>() {
  return "h";
}
template <>
inline const char* messageLayout<tf2_msgs::TFMessage>() {
  return "t";
}

/// Whether every list and text of a serialised message is as long as it says. roscpp takes memory for a list before it
/// looks: up to 32 GiB from a few bytes.
bool messageFits(const char* layout, const std::uint8_t* data, std::size_t size);

/// A message of a bag, or null when it is of another type. Throws std::exception where it is damaged.
template <typename Message>
boost::shared_ptr<Message> messageOf(const rosbag::MessageInstance& instance) {
  if (!instance.isType<Message>()) return nullptr;
  std::vector<std::uint8_t> bytes(instance.size());
  ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  instance.write(out);
  if (!messageFits(messageLayout<Message>(), bytes.data(), bytes.size())) {
    throw std::runtime_error("a message on " + instance.getTopic() + " is shorter than it says");
  }
  auto message = boost::make_shared<Message>();
  ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::deserialize(in, *message);
  return message;
}

}  // namespace xray_registration
