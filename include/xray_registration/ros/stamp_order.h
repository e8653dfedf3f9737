#pragma once

#include <ros/time.h>

namespace xray_registration {

/// What the stamp of a frame says beside those before it.
enum class StampVerdict {
  kNext,            ///< Newer than all before it.
  kNone,            ///< Zero.
  kRepeated,        ///< The last one's.
  kLate,            ///< A little older than the last one: overtaken on the way.
  kRecordingAgain,  ///< Much older, in simulated time: another recording, or the same from its start.
  kClockSetBack,    ///< Much older, on the wall's clock: the clock was corrected, the patient has not moved.
};

/// Keeps the order of stamps. Not thread-safe.
class StampOrder {
 public:
  /// A single image is never so late; a recording that starts again goes back by more.
  static constexpr double kLateSeconds = 1.0;

  /// `simulated`: ros::Time::isSimTime().
  explicit StampOrder(bool simulated) : simulated_(simulated) {}

  StampVerdict judge(const ros::Time& stamp) {
    if (stamp.isZero()) return StampVerdict::kNone;
    if (stamp == last_) return StampVerdict::kRepeated;
    const double back_s = last_.toSec() - stamp.toSec();
    if (back_s > 0.0 && back_s < kLateSeconds) return StampVerdict::kLate;
    last_ = stamp;
    if (back_s <= 0.0) return StampVerdict::kNext;
    return simulated_ ? StampVerdict::kRecordingAgain : StampVerdict::kClockSetBack;
  }

  /// Whatever comes next is the first.
  void forget() { last_ = ros::Time(); }

 private:
  bool simulated_;
  ros::Time last_;
};

}  // namespace xray_registration
