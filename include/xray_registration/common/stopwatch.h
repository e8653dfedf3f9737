#pragma once

#include <chrono>

namespace xray_registration {

/// Measures time from when it is made, on the steady clock.
class Stopwatch {
 public:
  double milliseconds() const { return std::chrono::duration<double, std::milli>(Clock::now() - begin_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_ = Clock::now();
};

}  // namespace xray_registration
