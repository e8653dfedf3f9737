#pragma once

// A head, an X-ray camera, and their messages, for the tests that talk to a running node.

#include <geometry_msgs/PoseStamped.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>

#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/evaluation/xray_simulator.h"
#include "xray_registration/ros/conversions.h"
#include "xray_registration/volume/phantom.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration {

inline sensor_msgs::Image imageMessage(const Image<std::uint16_t>& xray, const ros::Time& stamp,
                                       const std::string& frame_id) {
  sensor_msgs::Image message;
  message.header.stamp = stamp;
  message.header.frame_id = frame_id;
  message.width = static_cast<std::uint32_t>(xray.width);
  message.height = static_cast<std::uint32_t>(xray.height);
  message.encoding = "mono16";
  message.step = message.width * 2;
  message.data.resize(xray.pixels.size() * 2);
  std::memcpy(message.data.data(), xray.pixels.data(), message.data.size());
  return message;
}

inline sensor_msgs::CameraInfo infoMessage(const XrayCamera& camera, const std_msgs::Header& header) {
  sensor_msgs::CameraInfo message;
  message.header = header;
  message.width = static_cast<std::uint32_t>(camera.width);
  message.height = static_cast<std::uint32_t>(camera.height);
  message.K = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  message.distortion_model = "plumb_bob";
  message.D.assign(5, 0.0);
  return message;
}

class Scene {
 public:
  /// Writes the CT below the folder for temporary files.
  explicit Scene(const std::string& name) {
    const Volume ct = headPhantom(3.0);
    attenuation_ = toAttenuation(ct, AttenuationModel{});
    centre_ct_ = anatomicalCentreCt(attenuation_);
    path_ = std::filesystem::temp_directory_path() / ("xray_registration_" + name + ".nii.gz");
    writeVolume(ct, path_.string());
    camera_.width = camera_.height = 128;
    camera_.fx = camera_.fy = 400.0;  // Source to detector 1000 mm, pixels of 2.5 mm.
    camera_.cx = camera_.cy = 63.5;
  }
  ~Scene() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  std::string ctPath() const { return path_.string(); }
  const Eigen::Vector3d& centreCt() const { return centre_ct_; }

  /// The head from the front, slowly moving: about 1.5 mm and 0.4° from one number to the next.
  RigidTransform pose(int number) const {
    Eigen::Matrix3d R;
    R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    RigidTransform T = RigidTransform::Identity();
    T.linear() = R;
    T.translation() = Eigen::Vector3d(0, 0, 750) - R * centre_ct_;
    Twist twist;
    twist << 1.2 * number, -0.8 * number, 0.5 * number, 0.003 * number, 0.005 * number, -0.004 * number;
    return updatedPose(T, twist, T * centre_ct_);
  }

  /// Off by 2.2 mm and 1.4°.
  RigidTransform disturbed(const RigidTransform& T_camera_ct) const {
    Twist twist;
    twist << 1.5, -1.5, 0.5, 0.015, -0.015, 0.01;
    return updatedPose(T_camera_ct, twist, T_camera_ct * centre_ct_);
  }

  PoseError error(const RigidTransform& found, const RigidTransform& truth) const {
    return poseError(found, truth, targetGrid(centre_ct_, 100.0));
  }

  sensor_msgs::Image image(const RigidTransform& T_camera_ct, const ros::Time& stamp,
                           const std::string& frame_id) const {
    std::mt19937_64 random(42 + stamp.toNSec());  // Noise makes every image another, as with a real detector.
    const Image<std::uint16_t> xray = simulateXray(attenuation_, T_camera_ct, camera_, XrayPhysics{}, &random);
    return imageMessage(xray, stamp, frame_id);
  }

  sensor_msgs::CameraInfo info(const std_msgs::Header& header) const { return infoMessage(camera_, header); }

 private:
  AttenuationVolume attenuation_;
  Eigen::Vector3d centre_ct_ = Eigen::Vector3d::Zero();
  XrayCamera camera_;
  std::filesystem::path path_;
};

// A single view sees well within its plane; there the bound is the project's measure of success. Along the beam it
// hardly sees: the X-ray is of voxel boxes and the DRR interpolates, which with these coarse voxels is worth some
// millimetres.
constexpr double kInplaneTolerance = 0.5;  // mm
constexpr double kMtreTolerance = 6.0;     // mm

}  // namespace xray_registration
