#include "xray_registration/ros/image_gate.h"

#include "xray_registration/ros/conversions.h"

namespace xray_registration {

ImageGate::ImageGate(std::size_t views, const StampParameters& parameters, bool simulated, bool looks_for_held)
    : views_(views, View{StampGuard(parameters, simulated), HeldImage()}), looks_for_held_(looks_for_held) {}

ImageGate::Judgement ImageGate::judge(std::size_t view, const sensor_msgs::Image& image, const ros::Time& now,
                                      Clock::time_point at) {
  if (forget_.exchange(false)) {
    for (View& one : views_) {
      one.stamps.forget();
      one.held.forget();
    }
  }
  View& own = views_[view];
  Judgement judgement;
  judgement.stamp = own.stamps.judge({sinceZero(image.header.stamp), sinceZero(now), at});
  if (judgement.stamp.problem.empty() && looks_for_held_ && !image.data.empty()) {
    judgement.held_for_s = own.held.heldFor(quickHash(image.data.data(), image.data.size()), at);
  }
  return judgement;
}

}  // namespace xray_registration
