#pragma once

#include <chrono>
#include <deque>
#include <mutex>
#include <optional>

namespace xray_registration {

/// When a picture of a result is made: where it keeps no frame waiting, since it is done before the next one is due;
/// else as often as takes a tenth of the time. Who looks at pictures costs the poses next to nothing so, and sees fewer
/// of them on a machine that is busy. frameCame() may be called from any thread, the rest from one.
class PictureBudget {
 public:
  using Clock = std::chrono::steady_clock;

  /// Of every frame, also of one that is dropped later.
  void frameCame(Clock::time_point arrived);

  /// How long the last picture took.
  void made(Clock::time_point start, Clock::time_point end);

  /// From when on the picture of the frame that came at `arrived` may be made, unless another frame comes before; no
  /// earlier than `now`.
  Clock::time_point due(Clock::time_point arrived, Clock::time_point now) const;

 private:
  bool fitsBeforeTheNext(Clock::time_point arrived, Clock::time_point now) const;

  mutable std::mutex mutex_;
  std::optional<Clock::time_point> last_came_;
  std::deque<double> gaps_s_;  ///< Between the last frames.
  double cost_s_ = 0.0;        ///< Of the dearest of the last pictures, fading.
  Clock::time_point last_end_;
};

}  // namespace xray_registration
