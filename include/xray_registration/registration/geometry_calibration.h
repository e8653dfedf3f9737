#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "xray_registration/drr/engine.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// What a view's X-rays were taken with, against what was told.
struct ViewGeometry {
  double focal_scale = 1.0;                                   ///< Both focal lengths, true over told.
  Eigen::Vector2d centre_shift_px = Eigen::Vector2d::Zero();  ///< True less told, pixels of the image as it came.
  double radial = 0.0;  ///< True less told k1 (plumb_bob: a point at radius r of the plane z = 1 is seen at r + k1 r³).
  RigidTransform T_view_first = RigidTransform::Identity();  ///< Points of the first view's camera into this one's.
};

/// A frame's views, all of them, with the cameras, undistorted and with the relative poses that `geometry` (one for
/// each view) makes of what was told. Called several times for a frame.
using MakeCalibrationViews =
    std::function<std::vector<ViewInput>(std::size_t frame, const std::vector<ViewGeometry>& geometry)>;

/// How far from where the DRR has it a piece of an X-ray lies.
struct ResidualMotion {
  std::size_t frame = 0;
  std::size_t view = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();      ///< Middle of the piece, pixels of the image as it came.
  Eigen::Vector2d motion_px = Eigen::Vector2d::Zero();  ///< The X-ray's place less the DRR's.
  double correlation = 0.0;
};

/// One σ: of what was solved for, and of what was held, as if it were freed as well. What is not determined counts as
/// free, so a relative pose that hangs on a principal point has a σ that covers what the X-rays leave of that.
struct ViewGeometrySigma {
  double focal_scale = 0.0;
  double centre_px = 0.0;  ///< Of the worse axis.
  double radial = 0.0;
  double rotation_rad = 0.0;    ///< Of the relative pose: root mean square of the error's angle,
  double translation_mm = 0.0;  ///< of its length at the CT's centre,
  double source_mm = 0.0;       ///< and at the view's source, which the rotation moves on a long lever.
};

struct CalibratedView {
  ViewGeometry geometry;
  ViewGeometrySigma sigma;
  /// What the X-rays do not determine: focal_length, principal_point and distortion stay as they were told. view_pose
  /// too, unless the X-rays contradict it: then it is the best that goes with what is held, within its σ.
  std::vector<std::string> undetermined;

  bool isDetermined(const std::string& what) const;
};

struct GeometryCalibration {
  std::vector<CalibratedView> views;
  std::vector<RigidTransform> T_camera_ct;  ///< Of each frame, with the calibrated geometry.
  double similarity_before = 0.0;           ///< Mean correlation of the windows, over all frames.
  double similarity_after = 0.0;
  std::vector<ResidualMotion> before;
  std::vector<ResidualMotion> after;
  bool converged = false;
};

/// What an error has to reach to matter: a parameter whose σ is larger is not determined. Beyond these sizes the pose
/// of a CT at the middle of a C-arm is off by a millimetre or more.
struct CalibrationLimits {
  double focal_scale = 0.005;
  double centre_px = 3.0;        ///< In an image of 256 px, larger in proportion in a larger one.
  double distortion_px = 1.0;    ///< At half the width of an image of 256 px, in proportion in a larger one.
  double rotation_rad = 0.0035;  ///< 0.2°, each axis.
  double translation_mm = 1.0;   ///< Each axis, at the CT.
};

/// Calibrates with the CT as the body of known shape and size (its scale is held at 1): all frames share the views'
/// geometry, each has its own pose of the CT. Damped Gauss-Newton on the fast method's robust objective, coarse to
/// fine, with the poses eliminated frame by frame (the Schur complement of bundle adjustment; B. Triggs et al., 1999).
///
/// Much of a geometry imitates each other, and a CT's own errors would move what was right. So causes (focal lengths,
/// principal points, relative poses; in all views alike, or in each by itself) are freed one after the other, while a
/// further one explains the X-rays better by more than chance, the simplest of those that explain nearly as much;
/// distortion comes last. What is not freed agrees with what was told and stays there. What is freed or could be, but
/// has a σ beyond its limit with it, is not determined: it is held at what was told, the rest is solved again, and it
/// is named. A relative pose that the X-rays contradict is found in any case, since it takes up what others imitate. σ
/// is from the gradients of blocks of windows (docs/calibration.md), so it holds noise and a model's errors inside the
/// images, but not a CT that is wrong as a whole.
/// @param engine  With the CT on it.
/// @param T_camera_ct  One for each frame, as registered with the geometry as told.
/// @param told  One for each view: no corrections, and the relative poses as told.
/// @param progress  Called after each evaluation of a frame; may be empty.
/// @throws DeviceError, std::invalid_argument without frames or views.
GeometryCalibration calibrateGeometry(Engine* engine, const MakeCalibrationViews& make_views,
                                      const std::vector<RigidTransform>& T_camera_ct,
                                      const std::vector<ViewGeometry>& told, const CalibrationLimits& limits = {},
                                      const std::function<void()>& progress = {});

}  // namespace xray_registration
