#include "tools/register_bag/frame_filter.h"

#include <algorithm>

#include "xray_registration/ros/conversions.h"
#include "xray_registration/ros/result_transforms.h"

namespace xray_registration::tools {

FrameFilter::FrameFilter(const BagSession& session, const NodeParameters& parameters)
    : session_(session),
      frames_(parameters.frames),
      bodies_(parameters.bodies),
      health_(parameters.health),
      allow_missing_view_(parameters.sync.allow_missing_view),
      held_(session.views().size()) {}

std::string FrameFilter::frameId(const BagFrame& frame) const {
  const sensor_msgs::ImageConstPtr& image = frame.views.front().image;
  return image ? tfFrame(image->header.frame_id) : session_.views().front().frame_id;
}

std::string FrameFilter::problem(const BagFrame& frame, RegistrationPipeline* pipeline) {
  const Held held_images = held(frame);
  if (frame.stamp.isZero()) return "the image has no stamp (it is zero)";
  // Poses of one stamp contradict each other in tf: a view that came late may make a second frame of it.
  if (!stamps_.insert(frame.stamp).second) return "a frame with this stamp was already handled";
  watch(frame.stamp, pipeline);
  const std::string frame_id = frameId(frame);
  std::string problem = frameProblem(frame_id, frames_, bodies_);
  if (!problem.empty()) {
    pipeline->noteUnusable();
    return problem;
  }
  problem = frameChangeProblem(frame_id, session_.views().front().frame_id, frames_);
  if (!problem.empty()) return problem;
  if (held_images.longest_s > health_.hold_timeout_s) pipeline->loseTrack();
  return held_images.problem;
}

/// As the node does by its clock: where the CT is after so long, nobody knows.
void FrameFilter::watch(const ros::Time& stamp, RegistrationPipeline* pipeline) const {
  if (last_looked_at_ && stamp.toSec() - last_looked_at_->toSec() > health_.pose_age_error_s) pipeline->loseTrack();
}

FrameFilter::Held FrameFilter::held(const BagFrame& frame) {
  Held all;
  bool some_new = false;
  for (std::size_t i = 0; health_.hold_timeout_s > 0.0 && i < frame.views.size(); ++i) {
    const sensor_msgs::ImageConstPtr& image = frame.views[i].image;
    if (!image || image->data.empty()) continue;
    const auto taken = HeldImage::Clock::time_point(sinceZero(image->header.stamp));
    const std::optional<double> for_s = held_[i].heldFor(quickHash(image->data.data(), image->data.size()), taken);
    if (!for_s) {
      some_new = true;
      continue;
    }
    const std::string& name = session_.views()[i].name;
    if (!all.problem.empty()) all.problem += "; ";
    all.problem +=
        (name.empty() ? "" : "view '" + name + "': ") + "the image is held: its pixels are those of the one before";
    all.longest_s = std::max(all.longest_s, *for_s);
  }
  return some_new && allow_missing_view_ ? Held{} : all;
}

}  // namespace xray_registration::tools
