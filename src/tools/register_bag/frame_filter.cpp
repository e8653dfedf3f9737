#include "tools/register_bag/frame_filter.h"

#include "xray_registration/ros/conversions.h"
#include "xray_registration/ros/result_transforms.h"

namespace xray_registration::tools {

FrameFilter::FrameFilter(const BagSession& session, const NodeParameters& parameters)
    : session_(session),
      frames_(parameters.frames),
      bodies_(parameters.bodies),
      allow_missing_view_(parameters.sync.allow_missing_view),
      looks_for_held_(parameters.health.hold_timeout_s > 0.0),
      held_(session.views().size()) {}

std::string FrameFilter::frameId(const BagFrame& frame) const {
  const sensor_msgs::ImageConstPtr& image = frame.views.front().image;
  return image ? tfFrame(image->header.frame_id) : session_.views().front().frame_id;
}

std::string FrameFilter::problem(const BagFrame& frame) {
  const std::string held = heldProblem(frame);
  if (frame.stamp.isZero()) return "the image has no stamp (it is zero)";
  // Poses of one stamp contradict each other in tf: a view that came late may make a second frame of it.
  if (!stamps_.insert(frame.stamp).second) return "a frame with this stamp was already handled";
  const std::string frame_id = frameId(frame);
  std::string problem = frameProblem(frame_id, frames_, bodies_);
  if (!problem.empty()) return problem;
  const std::string change = frameChangeProblem(frame_id, session_.views().front().frame_id, frames_);
  return change.empty() ? held : change;
}

std::string FrameFilter::heldProblem(const BagFrame& frame) {
  std::string problem;
  bool some_new = false;
  for (std::size_t i = 0; looks_for_held_ && i < frame.views.size(); ++i) {
    const sensor_msgs::ImageConstPtr& image = frame.views[i].image;
    if (!image || image->data.empty()) continue;
    const auto taken = HeldImage::Clock::time_point(sinceZero(image->header.stamp));
    if (!held_[i].heldFor(quickHash(image->data.data(), image->data.size()), taken)) {
      some_new = true;
      continue;
    }
    const std::string& name = session_.views()[i].name;
    if (!problem.empty()) problem += "; ";
    problem +=
        (name.empty() ? "" : "view '" + name + "': ") + "the image is held: its pixels are those of the one before";
  }
  return some_new && allow_missing_view_ ? "" : problem;
}

}  // namespace xray_registration::tools
