#pragma once

#include <optional>
#include <string>

#include "xray_registration/registration/registrar.h"

namespace xray_registration {

enum class TrackingState { kWaitingForCt, kWaitingForPose, kTracking, kLost, kFault };
const char* toString(TrackingState state);

struct TrackerOptions {
  int frames_until_lost = 5;          ///< Refused frames in a row that make LOST.
  double max_prediction_gap_s = 1.0;  ///< Beyond this gap the velocity is not trusted.
  double max_velocity_mm_s = 200.0;   ///< Bound of the constant-velocity prediction.
  double max_velocity_rad_s = 2.0;
};

/// Follows a stream of frames: chooses each start (given pose, last accepted pose moved by a bounded constant velocity,
/// or an external motion), calls the registrar, and keeps the state. Same code in the node, register_bag and evaluate.
/// Not thread-safe.
class Tracker {
 public:
  explicit Tracker(const TrackerOptions& options);

  /// A start for the next frame; replaces all history. State becomes TRACKING on the next accepted frame; until then
  /// every frame starts from it.
  void setPose(const RigidTransform& T_camera_ct);
  /// Forgets pose and history (a time jump, ~reset).
  void reset();

  /// The pose where the next registration starts, or nothing when there is none yet (WAITING_FOR_POSE).
  /// `T_camera_now_camera_last` moves the last pose when the camera's own motion is known from tf.
  std::optional<RigidTransform> prediction(
      double stamp_s, const std::optional<RigidTransform>& T_camera_now_camera_last = std::nullopt) const;

  /// Whether the prediction comes from an accepted neighbour (Registrar::registerFrame's `tracking`).
  bool isTracking() const { return state_ == TrackingState::kTracking; }

  /// Predicts, registers, judges, updates. Without a pose: a refused result with the reason.
  RegistrationResult process(Registrar* registrar, const std::vector<ViewInput>& views, double stamp_s,
                             const std::optional<RigidTransform>& T_camera_now_camera_last = std::nullopt);

  /// New bounds from the next frame on; the history is kept.
  void setOptions(const TrackerOptions& options) { options_ = options; }

  TrackingState state() const { return state_; }
  int refusedInARow() const { return refused_in_a_row_; }

 private:
  TrackerOptions options_;
  TrackingState state_ = TrackingState::kWaitingForPose;
  std::optional<RigidTransform> given_;
  struct Accepted {
    double stamp_s = 0.0;
    RigidTransform T_camera_ct;
  };
  std::optional<Accepted> last_;
  std::optional<Accepted> before_last_;
  int refused_in_a_row_ = 0;
  Eigen::Vector3d centre_ct_ = Eigen::Vector3d::Zero();
};

}  // namespace xray_registration
