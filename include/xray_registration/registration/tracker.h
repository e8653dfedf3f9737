#pragma once

#include <optional>
#include <string>
#include <vector>

#include "xray_registration/registration/pose_history.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

enum class TrackingState { kWaitingForCt, kWaitingForPose, kTracking, kLost, kFault };
const char* toString(TrackingState state);

struct TrackerOptions {
  int frames_until_lost = 5;          ///< Refused frames in a row that make LOST.
  double max_prediction_gap_s = 1.0;  ///< Beyond this gap the velocity is not trusted.
  double max_velocity_mm_s = 200.0;   ///< Bounds of the constant-velocity prediction.
  double max_velocity_rad_s = 2.0;
};

/// Follows a stream of frames: chooses each start (given pose, last accepted pose moved by a bounded constant velocity,
/// or an external motion), calls the registrar, and keeps the state. Bodies that move on their own are followed the
/// same way, against the CT. Same code in the node, register_bag and evaluate. Not thread-safe.
class Tracker {
 public:
  explicit Tracker(const TrackerOptions& options);

  /// How many bodies there are beside the CT; forgets where they were.
  void followBodies(std::size_t count);

  /// A start for the next frame; replaces all history. State becomes TRACKING on the next accepted frame; until then
  /// every frame starts from it. Bodies start from where the CT has them.
  void setPose(const RigidTransform& T_camera_ct);
  /// The same with starts of the bodies against the CT.
  void setPose(const RigidTransform& T_camera_ct, const std::vector<RigidTransform>& T_ct_bodies);
  /// A start of one body against the CT, whose own history goes on; that body's next registration is a cold start.
  void setBodyPose(std::size_t body, const RigidTransform& T_ct_body);
  /// Forgets pose and history (a time jump, ~reset).
  void reset();

  /// The pose where the next registration starts, or nothing when there is none yet (WAITING_FOR_POSE).
  /// `T_camera_now_camera_last` moves the last pose when the camera's own motion is known from tf.
  std::optional<RigidTransform> prediction(
      double stamp_s, const std::optional<RigidTransform>& T_camera_now_camera_last = std::nullopt) const;

  /// Where the bodies' registrations start, against the CT.
  std::vector<BodyStart> bodyPredictions(double stamp_s) const;

  /// Whether the prediction comes from an accepted neighbour (Registrar::registerFrame's `tracking`).
  bool isTracking() const { return state_ == TrackingState::kTracking; }

  /// Predicts, registers, judges, updates. Without a pose: a refused result with the reason.
  RegistrationResult process(Registrar* registrar, const std::vector<ViewInput>& views, double stamp_s,
                             const std::optional<RigidTransform>& T_camera_now_camera_last = std::nullopt);

  /// A frame that could not be looked at counts as a refused one.
  void noteUnusable();
  /// Nothing was seen for too long: from TRACKING to LOST, as a run of refused frames makes it.
  void loseTrack();

  /// New bounds from the next frame on; the history is kept.
  void setOptions(const TrackerOptions& options) { options_ = options; }

  TrackingState state() const { return state_; }
  int refusedInARow() const { return refused_in_a_row_; }

 private:
  struct FollowedBody {
    RigidTransform T_ct_body_given = RigidTransform::Identity();
    PoseHistory history;  ///< Against the CT.
    Eigen::Vector3d centre_ct_mm = Eigen::Vector3d::Zero();
    int refused_in_a_row = 0;
  };

  void noteBodies(double stamp_s, const RegistrationResult& result);

  TrackerOptions options_;
  TrackingState state_ = TrackingState::kWaitingForPose;
  std::optional<RigidTransform> given_;
  PoseHistory history_;
  std::vector<FollowedBody> bodies_;
  int refused_in_a_row_ = 0;
  Eigen::Vector3d centre_ct_ = Eigen::Vector3d::Zero();
};

}  // namespace xray_registration
