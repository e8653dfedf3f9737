// A view as it comes in: a serialised sensor_msgs/Image and a CameraInfo, to pixels that can be registered.
#include <ros/serialization.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <cmath>
#include <optional>

#include "test/fuzz/fuzz_target.h"
#include "xray_registration/image/mask.h"
#include "xray_registration/image/xray_frame.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration::fuzz {
namespace {

/// Whether what a text or list says of its length fits into the message, which roscpp only sees after it has taken the
/// memory. Walks on behind it.
bool skipsList(std::size_t bytes_each, Bytes* bytes) {
  const std::size_t length = bytes->take<std::uint32_t>() * bytes_each;
  if (length > bytes->left()) return false;
  bytes->text(length);
  return true;
}

bool skipsHeader(Bytes* bytes) {
  bytes->text(12);  // seq and stamp.
  return skipsList(1, bytes);
}

bool imageLengthsFit(Bytes bytes) {
  if (!skipsHeader(&bytes)) return false;
  bytes.text(8);  // Height and width.
  if (!skipsList(1, &bytes)) return false;
  bytes.text(5);  // is_bigendian and step.
  return skipsList(1, &bytes);
}

bool cameraInfoLengthsFit(Bytes bytes) {
  if (!skipsHeader(&bytes)) return false;
  bytes.text(8);
  return skipsList(1, &bytes) && skipsList(sizeof(double), &bytes);
}

template <typename Message>
std::optional<Message> deserialised(std::string bytes) {
  Message message;
  ros::serialization::IStream stream(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                     static_cast<std::uint32_t>(bytes.size()));
  try {
    ros::serialization::deserialize(stream, message);
  } catch (const ros::serialization::StreamOverrunException&) {
    return std::nullopt;
  }
  return message;
}

void checkFrame(const XrayFrame& frame) {
  require(frame.camera.width == frame.attenuation.width() && frame.camera.height == frame.attenuation.height(),
          "the camera has the image's size");
  require(frame.mask.pixels.size() == frame.attenuation.values().pixels.size(), "the mask has the image's size");
  require(frame.camera.fx > 0.0 && frame.camera.fy > 0.0, "focal lengths are positive");
  for (const float value : frame.attenuation.values().pixels) require(std::isfinite(value), "attenuation is finite");
}

}  // namespace
}  // namespace xray_registration::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace xray_registration;
  using namespace xray_registration::fuzz;
  Bytes bytes(data, size);
  const auto options = bytes.take<std::uint8_t>();
  const std::string image_bytes = bytes.text(bytes.take<std::uint16_t>());
  const std::string info_bytes = bytes.rest();
  const auto view = [](const std::string& text) {
    return Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  };
  if (!imageLengthsFit(view(image_bytes)) || !cameraInfoLengthsFit(view(info_bytes))) return 0;
  const auto image = deserialised<sensor_msgs::Image>(image_bytes);
  const auto info = deserialised<sensor_msgs::CameraInfo>(info_bytes);
  if (!image || !info) return 0;
  LinearizeOptions linearize;
  linearize.kind = static_cast<ImageKind>(options % 3);
  try {
    RawImage raw = rawImage(*image);
    XrayFrame frame = makeXrayFrame(std::move(raw.pixels), raw.saturation, calibration(*info), linearize);
    maskFrame(&frame, {(options & 4U) != 0, (options & 8U) != 0, (options & 16U) != 0}, {});
    checkFrame(frame);
  } catch (const FrameError& error) {
    requireWords(error.what());
  }
  return 0;
}
