#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "xray_registration/pipeline/corrected_views.h"

namespace xray_registration {

/// Correlation of X-ray and DRR below which the pose is elsewhere, and a frame no use to calibrate with. Right poses in
/// a set-up that is 2 % of focal length, 12 px and 1° off have 0.6 and more.
constexpr double kAlikeEnoughToCalibrate = 0.45;

/// The indices of up to `most` poses, the first one among them, each the farthest from those before; ascending.
std::vector<std::size_t> mostDifferent(const std::vector<RigidTransform>& T_camera_ct,
                                       const Eigen::Vector3d& centre_ct_mm, std::size_t most);

/// Frames that were registered, kept to calibrate with: a few, whose poses differ the most. Not thread-safe.
class CalibrationFrames {
 public:
  /// A frame's views as told, made anew at each call: what is kept is where they come from.
  using Views = std::function<std::vector<RawView>()>;

  /// @param most  0 keeps none.
  explicit CalibrationFrames(std::size_t most) : most_(most) {}

  void add(Views views, const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm);
  void forget();

  std::size_t size() const { return views_.size(); }
  /// The last frame's.
  std::vector<RawView> told() const { return views_.front()(); }

  /// Calibrates (geometry_calibration.h) with all of them, from what was told of the last one.
  /// @param progress  Called after each evaluation of a frame; what it throws ends the calibration.
  /// @throws DeviceError, FrameError, ParameterError; std::invalid_argument without frames.
  GeometryCalibration calibrate(Engine* engine, const ImageParameters& image,
                                const std::function<void()>& progress) const;

 private:
  std::size_t most_;
  std::vector<Views> views_;                 ///< The newest first.
  std::vector<RigidTransform> T_camera_ct_;  ///< Of each frame.
};

}  // namespace xray_registration
