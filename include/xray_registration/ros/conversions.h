#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/PoseWithCovariance.h>
#include <geometry_msgs/Transform.h>
#include <ros/time.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <chrono>
#include <string>

#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/image/raw_image.h"
#include "xray_registration/image/xray_frame.h"
#include "xray_registration/pipeline/overlay.h"

namespace xray_registration {

/// A time as the rooms below know it.
inline std::chrono::nanoseconds sinceZero(const ros::Time& time) {
  return std::chrono::seconds(time.sec) + std::chrono::nanoseconds(time.nsec);
}

/// A frame's name as tf2 has it: without the leading slash of tf's first version.
std::string tfFrame(std::string frame_id);

/// Reads mono8, mono16, 8UC1, 16UC1 and 32FC1 of either endianness and any row step.
/// @throws FrameError for any other encoding, a zero size, a row step shorter than a row, or too little data.
RawImage rawImage(const sensor_msgs::Image& message);

/// Copies what a CameraInfo states. ROS' binning 0 means 1. Nothing is judged here; cameraFromCalibration does that.
Calibration calibration(const sensor_msgs::CameraInfo& message);

/// A single-channel image as 32FC1, in the host's endianness. The header is left to the caller.
sensor_msgs::Image toFloatMessage(const FloatImage& image);

/// The same as mono8 for display: the image's smallest value becomes 0 and its largest 255; a constant image is black.
sensor_msgs::Image toDisplayMessage(const FloatImage& image);

/// A picture in colour as rgb8.
sensor_msgs::Image toColourMessage(const RgbImage& image);

/// Millimetres ↔ metres. `what` names the pose in the message of the exception.
/// @throws std::invalid_argument when a number is not finite or the quaternion's length differs from 1 by more than 1
/// %.
RigidTransform fromPose(const geometry_msgs::Pose& pose, const std::string& what = "pose");
RigidTransform fromTransform(const geometry_msgs::Transform& transform, const std::string& what = "transform");
geometry_msgs::Pose toPose(const RigidTransform& transform);
geometry_msgs::Transform toTransform(const RigidTransform& transform);

/// A solver's covariance ([mm; rad], about the CT centre, camera axes) as REP-103 has it: metres and radians, x, y, z
/// of the CT frame's origin and rotations about the camera frame's fixed axes.
Matrix6d poseCovariance(const Matrix6d& covariance_mm, const RigidTransform& T_camera_ct,
                        const Eigen::Vector3d& centre_ct_mm);
geometry_msgs::PoseWithCovariance toPoseWithCovariance(const RigidTransform& T_camera_ct, const Matrix6d& covariance_mm,
                                                       const Eigen::Vector3d& centre_ct_mm);

}  // namespace xray_registration
