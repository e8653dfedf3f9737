#include "xray_registration/ros/conversions.h"

#include <sensor_msgs/image_encodings.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <type_traits>

#include "xray_registration/geometry/cross_matrix.h"

namespace xray_registration {

namespace encodings = sensor_msgs::image_encodings;

namespace {

constexpr double kMetresPerMillimetre = 1e-3;

bool hostIsBigEndian() {
  const std::uint16_t one = 1;
  std::uint8_t first = 0;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

template <typename T>
T readValue(const std::uint8_t* bytes, bool swap) {
  std::uint8_t ordered[sizeof(T)];
  std::memcpy(ordered, bytes, sizeof(T));
  if (swap) std::reverse(ordered, ordered + sizeof(T));
  T value;
  std::memcpy(&value, ordered, sizeof(T));
  return value;
}

/// Pixels of type T as a message has them, into an image of `Pixel`.
template <typename T, typename Pixel>
Image<Pixel> readPixels(const sensor_msgs::Image& message) {
  const std::size_t row_bytes = static_cast<std::size_t>(message.width) * sizeof(T);
  if (message.step < row_bytes) {
    throw FrameError("image step " + std::to_string(message.step) + " is shorter than a row of " +
                     std::to_string(message.width) + " pixels in " + message.encoding + " (" +
                     std::to_string(row_bytes) + " bytes)");
  }
  // The last row needs no padding behind it.
  const std::size_t needed = static_cast<std::size_t>(message.step) * (message.height - 1) + row_bytes;
  if (message.data.size() < needed) {
    throw FrameError("image data has " + std::to_string(message.data.size()) + " bytes where " +
                     std::to_string(message.width) + "x" + std::to_string(message.height) + " in " + message.encoding +
                     " needs " + std::to_string(needed));
  }
  const bool swap = sizeof(T) > 1 && (message.is_bigendian != 0) != hostIsBigEndian();
  Image<Pixel> image(static_cast<int>(message.width), static_cast<int>(message.height));
  for (int v = 0; v < image.height; ++v) {
    const std::uint8_t* row = message.data.data() + static_cast<std::size_t>(v) * message.step;
    if (std::is_same_v<T, Pixel> && !swap) {
      std::memcpy(&image.at(0, v), row, row_bytes);
      continue;
    }
    for (int u = 0; u < image.width; ++u) {
      image.at(u, v) = static_cast<Pixel>(readValue<T>(row + static_cast<std::size_t>(u) * sizeof(T), swap));
    }
  }
  return image;
}

template <typename Pixel>
sensor_msgs::Image emptyMessage(const Image<Pixel>& image, const std::string& encoding, std::size_t bytes_per_pixel) {
  sensor_msgs::Image message;
  message.width = static_cast<std::uint32_t>(image.width);
  message.height = static_cast<std::uint32_t>(image.height);
  message.encoding = encoding;
  message.is_bigendian = hostIsBigEndian() ? 1 : 0;
  message.step = static_cast<std::uint32_t>(message.width * bytes_per_pixel);
  message.data.resize(static_cast<std::size_t>(message.step) * message.height);
  return message;
}

RigidTransform rigid(double x, double y, double z, const geometry_msgs::Quaternion& q, const std::string& what) {
  try {
    return rigidFromQuaternion(Eigen::Vector3d(x, y, z) / kMetresPerMillimetre, Eigen::Quaterniond(q.w, q.x, q.y, q.z));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(what + " " + error.what());
  }
}

/// Into a message's point or vector.
template <typename Message>
void setMetres(const Eigen::Vector3d& position_mm, Message* message) {
  const Eigen::Vector3d metres = position_mm * kMetresPerMillimetre;
  message->x = metres.x();
  message->y = metres.y();
  message->z = metres.z();
}

geometry_msgs::Quaternion quaternionOf(const RigidTransform& transform) {
  const Eigen::Quaterniond rotation(transform.linear());
  geometry_msgs::Quaternion message;
  message.x = rotation.x();
  message.y = rotation.y();
  message.z = rotation.z();
  message.w = rotation.w();
  return message;
}

}  // namespace

std::string tfFrame(std::string frame_id) {
  frame_id.erase(0, frame_id.find_first_not_of('/'));
  return frame_id;
}

RawImage rawImage(const sensor_msgs::Image& message) {
  if (message.width == 0 || message.height == 0) {
    throw FrameError("image has size " + std::to_string(message.width) + "x" + std::to_string(message.height));
  }
  constexpr std::uint32_t kMaxSide = 1U << 15U;
  if (message.width > kMaxSide || message.height > kMaxSide) {
    throw FrameError("image has size " + std::to_string(message.width) + "x" + std::to_string(message.height) +
                     "; no side may be longer than " + std::to_string(kMaxSide));
  }
  const std::string& encoding = message.encoding;
  if (encoding == encodings::MONO8 || encoding == encodings::TYPE_8UC1) {
    return {readPixels<std::uint8_t, std::uint16_t>(message), 255.0};
  }
  if (encoding == encodings::MONO16 || encoding == encodings::TYPE_16UC1) {
    return {readPixels<std::uint16_t, std::uint16_t>(message), 65535.0};
  }
  if (encoding == encodings::TYPE_32FC1) {
    return {readPixels<float, float>(message), static_cast<double>(std::numeric_limits<float>::max())};
  }
  throw FrameError("image encoding '" + encoding + "' is not one of mono8, mono16, 8UC1, 16UC1, 32FC1");
}

Calibration calibration(const sensor_msgs::CameraInfo& message) {
  Calibration result;
  result.width = static_cast<int>(message.width);
  result.height = static_cast<int>(message.height);
  std::copy(message.K.begin(), message.K.end(), result.k.begin());
  result.distortion = message.D;
  result.distortion_model = message.distortion_model;
  result.binning_x = message.binning_x == 0 ? 1 : static_cast<int>(message.binning_x);
  result.binning_y = message.binning_y == 0 ? 1 : static_cast<int>(message.binning_y);
  result.roi_x = static_cast<int>(message.roi.x_offset);
  result.roi_y = static_cast<int>(message.roi.y_offset);
  result.roi_width = static_cast<int>(message.roi.width);
  result.roi_height = static_cast<int>(message.roi.height);
  return result;
}

sensor_msgs::Image toFloatMessage(const FloatImage& image) {
  sensor_msgs::Image message = emptyMessage(image, encodings::TYPE_32FC1, sizeof(float));
  if (!image.empty()) std::memcpy(message.data.data(), image.pixels.data(), message.data.size());
  return message;
}

sensor_msgs::Image toDisplayMessage(const FloatImage& image) {
  sensor_msgs::Image message = emptyMessage(image, encodings::MONO8, 1);
  if (image.empty()) return message;
  const auto [low, high] = std::minmax_element(image.pixels.begin(), image.pixels.end());
  const float offset = *low;
  const float scale = *high > *low ? 255.0F / (*high - *low) : 0.0F;
  std::transform(image.pixels.begin(), image.pixels.end(), message.data.begin(),
                 [&](float value) { return static_cast<std::uint8_t>(std::lround((value - offset) * scale)); });
  return message;
}

sensor_msgs::Image toColourMessage(const RgbImage& image) {
  sensor_msgs::Image message = emptyMessage(image, encodings::RGB8, sizeof(Rgb));
  if (!image.empty()) std::memcpy(message.data.data(), image.pixels.data(), message.data.size());
  return message;
}

RigidTransform fromPose(const geometry_msgs::Pose& pose, const std::string& what) {
  return rigid(pose.position.x, pose.position.y, pose.position.z, pose.orientation, what);
}

RigidTransform fromTransform(const geometry_msgs::Transform& transform, const std::string& what) {
  return rigid(transform.translation.x, transform.translation.y, transform.translation.z, transform.rotation, what);
}

geometry_msgs::Pose toPose(const RigidTransform& transform) {
  geometry_msgs::Pose pose;
  setMetres(transform.translation(), &pose.position);
  pose.orientation = quaternionOf(transform);
  return pose;
}

geometry_msgs::Transform toTransform(const RigidTransform& transform) {
  geometry_msgs::Transform message;
  setMetres(transform.translation(), &message.translation);
  message.rotation = quaternionOf(transform);
  return message;
}

Matrix6d poseCovariance(const Matrix6d& covariance_mm, const RigidTransform& T_camera_ct,
                        const Eigen::Vector3d& centre_ct_mm) {
  // The solver turns about the CT centre c, the message is about the CT's origin p: dp = v + w x (p - c).
  const Eigen::Vector3d lever_mm = T_camera_ct.translation() - T_camera_ct * centre_ct_mm;
  Matrix6d jacobian = Matrix6d::Identity();
  jacobian.topRightCorner<3, 3>() = -crossMatrix(lever_mm);
  jacobian.topRows<3>() *= kMetresPerMillimetre;
  return jacobian * covariance_mm * jacobian.transpose();
}

geometry_msgs::PoseWithCovariance toPoseWithCovariance(const RigidTransform& T_camera_ct, const Matrix6d& covariance_mm,
                                                       const Eigen::Vector3d& centre_ct_mm) {
  geometry_msgs::PoseWithCovariance message;
  message.pose = toPose(T_camera_ct);
  const Matrix6d covariance = poseCovariance(covariance_mm, T_camera_ct, centre_ct_mm);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) message.covariance[row * 6 + column] = covariance(row, column);
  }
  return message;
}

}  // namespace xray_registration
