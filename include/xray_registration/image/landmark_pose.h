#pragma once

#include <string>
#include <vector>

#include "xray_registration/common/escaped.h"
#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/xray_camera.h"

namespace xray_registration {

/// Why points give no pose, in words.
class LandmarkError : public EscapedError {
 public:
  using EscapedError::EscapedError;
};

/// A point of the CT and where a view shows it.
struct Landmark {
  std::string name;          ///< The same point in several views has the same name; may be empty.
  Eigen::Vector3d point_ct;  ///< mm
  Eigen::Vector2d pixel;     ///< Column and row of the straight image; integers are pixel centres.
  std::size_t view = 0;
};

/// A view that landmarks are seen in.
struct LandmarkView {
  XrayCamera camera;
  RigidTransform T_view_first = RigidTransform::Identity();  ///< Maps points of the first view's camera.
};

struct LandmarkOptions {
  /// Largest residual of a point that agrees; 0: 1 % of the image's width, 3 px at least, which careful clicks keep.
  double inlier_px = 0.0;
};

struct LandmarkPose {
  RigidTransform T_first_ct = RigidTransform::Identity();
  std::vector<double> residual_px;  ///< Of each landmark.
  std::vector<bool> used;           ///< Whether it agrees.
  double rms_px = 0.0;              ///< Of those used.

  std::size_t usedCount() const;
};

/// The pose of the CT from points of it and their pixels. Pure; any thread; the same input gives the same pose.
///
/// One view needs four points: three make up to four poses, the fourth tells which (P3P). From six on, wrong points are
/// found and left out (EPnP in RANSAC). Several views add up; with two, three points seen in both are enough. All that
/// agree are refined together.
/// @param landmarks  Views are indices of `views`.
/// @throws LandmarkError for too few points; points that coincide, in the CT or in a view; points on a line; points
/// that fit only as their mirror image; two poses that fit alike; too few that agree.
/// @throws std::invalid_argument for a view that there is none of, or numbers that are not finite.
LandmarkPose poseFromLandmarks(const std::vector<Landmark>& landmarks, const std::vector<LandmarkView>& views,
                               const LandmarkOptions& options = {});

}  // namespace xray_registration
