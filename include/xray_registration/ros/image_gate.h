#pragma once

#include <sensor_msgs/Image.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

#include "xray_registration/pipeline/held_image.h"
#include "xray_registration/pipeline/stamp_guard.h"

namespace xray_registration {

/// What every image of every view has to pass before anything else sees it: the guard of its stamps, and the look at
/// whether it is a new one. judge() belongs to one thread.
class ImageGate {
 public:
  using Clock = std::chrono::steady_clock;

  struct Judgement {
    StampJudgement stamp;
    std::optional<double> held_for_s;  ///< Since when the same pixels come; nothing for a new image.
  };

  /// `looks_for_held`: whether pixels are compared at all.
  ImageGate(std::size_t views, const StampParameters& parameters, bool simulated, bool looks_for_held);

  /// `now`: the node's clock; `at`: the steady one.
  Judgement judge(std::size_t view, const sensor_msgs::Image& image, const ros::Time& now, Clock::time_point at);

  /// Whatever comes next is the first. From any thread.
  void forget() { forget_ = true; }

 private:
  struct View {
    StampGuard stamps;
    HeldImage held;
  };
  std::vector<View> views_;
  bool looks_for_held_;
  std::atomic<bool> forget_{false};
};

}  // namespace xray_registration
