#pragma once

#include <ros/time.h>

namespace xray_registration {

/// Notices that simulated time was set back: a recording or a simulation that starts again. The wall's clock never
/// counts: when it is corrected, the patient has not moved. Not thread-safe.
class ClockWatch {
 public:
  /// A recording that starts again goes back by more. What is less is a clock that wavers: /clock comes at 10 Hz or
  /// faster, and two sources of it may lie a period apart.
  static constexpr double kToleranceSeconds = 0.1;

  /// `simulated`: ros::Time::isSimTime().
  explicit ClockWatch(bool simulated) : simulated_(simulated) {}

  /// To be told of every now that is seen; true once for each step back.
  bool wentBack(const ros::Time& now) {
    // From the latest time of all, so that small steps add up.
    const bool back = simulated_ && now.toSec() < latest_.toSec() - kToleranceSeconds;
    if (back || now > latest_) latest_ = now;
    return back;
  }

 private:
  bool simulated_;
  ros::Time latest_;
};

}  // namespace xray_registration
