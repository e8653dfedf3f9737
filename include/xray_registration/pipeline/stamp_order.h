#pragma once

#include <chrono>

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
  static constexpr std::chrono::seconds kLate{1};

  /// `simulated`: stamps are of a recording or a simulation, not of the wall's clock.
  explicit StampOrder(bool simulated) : simulated_(simulated) {}

  /// `stamp`: since the clock's own zero.
  StampVerdict judge(std::chrono::nanoseconds stamp) {
    if (stamp == std::chrono::nanoseconds::zero()) return StampVerdict::kNone;
    if (stamp == last_) return StampVerdict::kRepeated;
    const bool back = stamp < last_;
    if (back && last_ - stamp < kLate) return StampVerdict::kLate;
    last_ = stamp;
    if (!back) return StampVerdict::kNext;
    return simulated_ ? StampVerdict::kRecordingAgain : StampVerdict::kClockSetBack;
  }

  /// Whatever comes next is the first.
  void forget() { last_ = std::chrono::nanoseconds::zero(); }

 private:
  bool simulated_;
  std::chrono::nanoseconds last_{0};
};

}  // namespace xray_registration
