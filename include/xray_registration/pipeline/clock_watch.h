#pragma once

#include <chrono>

namespace xray_registration {

/// Notices that simulated time was set back: a recording or a simulation that starts again. The wall's clock never
/// counts: when it is corrected, the patient has not moved. Not thread-safe.
class ClockWatch {
 public:
  /// A recording that starts again goes back by more. What is less is a clock that wavers: /clock comes at 10 Hz or
  /// faster, and two sources of it may lie a period apart.
  static constexpr std::chrono::milliseconds kTolerance{100};

  /// `simulated`: the clock is that of a recording or a simulation.
  explicit ClockWatch(bool simulated) : simulated_(simulated) {}

  /// To be told of every now that is seen; true once for each step back.
  bool wentBack(std::chrono::nanoseconds now) {
    // From the latest time of all, so that small steps add up.
    const bool back = simulated_ && now < latest_ - kTolerance;
    if (back || now > latest_) latest_ = now;
    return back;
  }

 private:
  bool simulated_;
  std::chrono::nanoseconds latest_{0};
};

}  // namespace xray_registration
