#pragma once

#include <sensor_msgs/CameraInfo.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/geometry/volume_grid.h"
#include "xray_registration/image/landmark_pose.h"
#include "xray_registration/image/undistortion_map.h"
#include "xray_registration/pipeline/parameters.h"
#include "xray_registration/ros/transforms.h"

namespace xray_registration {

/// A point of the CT and where a view's raw image shows it.
struct SeenPoint {
  Eigen::Vector3d point_ct;  ///< mm
  Eigen::Vector2d pixel;     ///< Integers are pixel centres.
  std::string view;          ///< As in the parameter `views`; empty: the first one.
};

struct SolvedLandmarks {
  LandmarkPose pose;
  std::string frame_id;  ///< The first view's optical frame.
};

/// Poses from landmarks in the views of the node, with the newest camera_info of each and tf between them. Thread-safe.
class LandmarkSolver {
 public:
  /// `transforms` must outlive this.
  /// @throws ParameterError when an undistortion map cannot be read.
  LandmarkSolver(const NodeParameters& parameters, const Transforms* transforms);

  void takeInfo(std::size_t view, const sensor_msgs::CameraInfoConstPtr& info);

  /// @param ct_grid  Where the CT is; nothing when there is none, for which points cannot be.
  /// @throws std::runtime_error and std::invalid_argument with the reason why there is no pose.
  SolvedLandmarks solve(const std::vector<SeenPoint>& points, const std::optional<VolumeGrid>& ct_grid) const;

  /// Number of a view; the first one's for an empty name. @throws std::invalid_argument when there is none of the name.
  std::size_t viewNumber(const std::string& name) const;

 private:
  sensor_msgs::CameraInfoConstPtr infoOf(std::size_t view) const;
  LandmarkView cameraOf(std::size_t view, const std::string& first_frame) const;
  Eigen::Vector2d straight(const SeenPoint& point, std::size_t number, std::size_t view) const;

  const Transforms* transforms_;
  std::vector<std::string> names_;
  std::vector<std::shared_ptr<const UndistortionMap>> maps_;  ///< Of each view; null where there is none.
  mutable std::mutex mutex_;
  std::vector<sensor_msgs::CameraInfoConstPtr> infos_;  ///< Of each view; null until one came.
};

}  // namespace xray_registration
