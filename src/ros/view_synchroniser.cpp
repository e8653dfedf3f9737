#include "xray_registration/ros/view_synchroniser.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace xray_registration {

namespace {

// CameraInfos may run ahead of their images (a large image takes longer); more than these are of no use.
constexpr std::size_t kInfosKept = 16;
constexpr std::size_t kImagesKept = 4;

const ros::Time& stampOf(const ViewMessage& message) { return message.image->header.stamp; }

// In double: the difference of two ros::Time throws when it leaves 32 bits, and a stamp may hold anything.
double secondsBetween(const ros::Time& earlier, const ros::Time& later) { return later.toSec() - earlier.toSec(); }

}  // namespace

bool FrameMessages::complete() const {
  return std::all_of(views.begin(), views.end(), [](const ViewMessage& view) { return view.problem.empty(); });
}

ViewSynchroniser::ViewSynchroniser(Options options, Callback on_frame)
    : options_(std::move(options)), on_frame_(std::move(on_frame)), views_(options_.views.size()) {}

void ViewSynchroniser::addImage(std::size_t view, const sensor_msgs::ImageConstPtr& image, Clock::time_point now,
                                const std::optional<double>& held_for_s) {
  const auto& infos = views_[view].infos;
  const auto match = std::find_if(infos.begin(), infos.end(), [&](const sensor_msgs::CameraInfoConstPtr& info) {
    return info->header.stamp == image->header.stamp;
  });
  if (match != infos.end()) {
    ready(view, {image, *match, "", held_for_s}, now);
    return;
  }
  auto& images = views_[view].images;
  images.push_back({image, now, held_for_s});
  if (images.size() > kImagesKept) giveUpOldest(view);
}

void ViewSynchroniser::addInfo(std::size_t view, const sensor_msgs::CameraInfoConstPtr& info) {
  auto& infos = views_[view].infos;
  infos.push_back(info);
  if (infos.size() > kInfosKept) infos.pop_front();
  auto& images = views_[view].images;
  const auto match = std::find_if(images.begin(), images.end(), [&](const WaitingImage& waiting) {
    return waiting.image->header.stamp == info->header.stamp;
  });
  if (match == images.end()) return;
  const WaitingImage found = *match;
  images.erase(match);
  ready(view, {found.image, info, "", found.held_for_s}, found.since);
}

void ViewSynchroniser::dropUnpaired(std::size_t view, const ros::Time& before) {
  auto& images = views_[view].images;
  while (!images.empty() && images.front().image->header.stamp < before) giveUpOldest(view);
}

void ViewSynchroniser::giveUpOldest(std::size_t view) {
  const WaitingImage unpaired = views_[view].images.front();
  views_[view].images.pop_front();
  ready(view, {unpaired.image, nullptr, "no camera_info came with the stamp of the image", unpaired.held_for_s},
        unpaired.since);
}

void ViewSynchroniser::ready(std::size_t view, ViewMessage message, Clock::time_point since) {
  const ros::Time stamp = stampOf(message);
  dropUnpaired(view, stamp);
  auto place = std::find_if(frames_.begin(), frames_.end(), [&](const WaitingFrame& frame) {
    return !frame.views[view].image && std::abs(secondsBetween(stamp, frame.stamp)) <= options_.tolerance_s;
  });
  if (place == frames_.end()) {
    frames_.push_back({stamp, since, std::vector<ViewMessage>(views_.size())});
    place = std::prev(frames_.end());
  }
  place->views[view] = std::move(message);
  const bool full =
      std::all_of(place->views.begin(), place->views.end(), [](const ViewMessage& v) { return v.image != nullptr; });
  std::deque<WaitingFrame> done;
  std::deque<WaitingFrame> waiting;
  // Older frames first: they cannot be completed once a newer one is, or once each missing view has moved on.
  for (auto frame = frames_.begin(); frame != frames_.end(); ++frame) {
    const bool overtaken = full && frame->stamp < place->stamp;
    const bool finished = frame == place ? full : overtaken || !canStillComplete(*frame, view, stamp);
    (finished ? done : waiting).push_back(std::move(*frame));
  }
  frames_ = std::move(waiting);
  for (WaitingFrame& frame : done) finish(std::move(frame));
}

bool ViewSynchroniser::canStillComplete(const WaitingFrame& frame, std::size_t view, const ros::Time& stamp) const {
  return frame.views[view].image || secondsBetween(frame.stamp, stamp) <= options_.tolerance_s;
}

void ViewSynchroniser::finish(WaitingFrame frame) {
  FrameMessages messages;
  for (ViewMessage& view : frame.views) {
    if (!view.image) {
      view.problem = "no image came within " + std::to_string(std::lround(options_.tolerance_s * 1000.0)) +
                     " ms of the other views' stamps";
    } else if (messages.header.stamp.isZero() && messages.header.frame_id.empty()) {
      messages.header = view.image->header;
    }
  }
  messages.views = std::move(frame.views);
  messages.arrived = frame.since;
  on_frame_(std::move(messages));
}

void ViewSynchroniser::expire(Clock::time_point now) {
  for (std::size_t view = 0; view < views_.size(); ++view) {
    const auto& images = views_[view].images;
    while (!images.empty() && now - images.front().since > options_.patience) giveUpOldest(view);
  }
  while (!frames_.empty() && now - frames_.front().since > options_.patience) {
    WaitingFrame frame = std::move(frames_.front());
    frames_.pop_front();
    finish(std::move(frame));
  }
}

void ViewSynchroniser::clear() {
  frames_.clear();
  for (View& view : views_) view = View{};
}

}  // namespace xray_registration
