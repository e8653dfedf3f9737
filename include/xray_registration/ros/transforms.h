#pragma once

#include <ros/time.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <string>

#include "xray_registration/geometry/rigid_transform.h"

namespace xray_registration {

/// Asks tf. A transform that is missing is never taken for the identity: the answer is empty and says why. Waits on the
/// wall's clock, so that a stopped simulated clock cannot hold the worker. Thread-safe.
class Transforms {
 public:
  Transforms();

  /// T_target_source in mm at `stamp` (zero: the newest), waiting for it no longer than `timeout_s`. `why` gets the
  /// reason in words when there is none.
  std::optional<RigidTransform> lookup(const std::string& target, const std::string& source, const ros::Time& stamp,
                                       double timeout_s, std::string* why) const;

  /// Drops what moves, for stamps that go on elsewhere: tf keeps nothing that is older than what it has.
  void forget() { buffer_.clear(); }

  /// Ends every wait.
  void stop() { stopped_ = true; }

 private:
  tf2_ros::Buffer buffer_;
  tf2_ros::TransformListener listener_;
  std::atomic<bool> stopped_{false};
};

}  // namespace xray_registration
