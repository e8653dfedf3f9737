#include "xray_registration/ros/frame_preparer.h"

#include <algorithm>
#include <utility>

namespace xray_registration {

namespace {

/// Messages are shared, not copied: the same ones are the same frame.
bool isSame(const std::optional<FrameMessages>& a, const FrameMessages& b) {
  return a && std::equal(a->views.begin(), a->views.end(), b.views.begin(), b.views.end(),
                         [](const ViewMessage& one, const ViewMessage& other) {
                           return one.image == other.image && one.info == other.info;
                         });
}

}  // namespace

FramePreparer::FramePreparer(Prepare prepare) : prepare_(std::move(prepare)), thread_([this] { run(); }) {}

FramePreparer::~FramePreparer() { stop(); }

void FramePreparer::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
    waiting_.reset();
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void FramePreparer::offer(const FrameMessages& frame) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stopped_) return;
    waiting_ = frame;
  }
  changed_.notify_all();
}

PreparedFrame FramePreparer::take(const FrameMessages& frame) {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    if (isSame(waiting_, frame)) waiting_.reset();
    changed_.wait(lock, [&] { return !isSame(current_, frame); });
    if (isSame(finished_, frame)) {
      finished_.reset();
      return std::move(prepared_);
    }
  }
  return prepare_(frame);
}

void FramePreparer::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopped_ || waiting_; });
    if (stopped_) return;
    current_ = std::exchange(waiting_, std::nullopt);
    const FrameMessages frame = *current_;
    lock.unlock();
    std::optional<PreparedFrame> prepared;
    try {
      prepared = prepare_(frame);
    } catch (const std::exception&) {
      // Who takes the frame tries again, and says what is wrong.
    }
    lock.lock();
    current_.reset();
    finished_.reset();
    if (prepared) {
      finished_ = frame;
      prepared_ = std::move(*prepared);
    }
    changed_.notify_all();
  }
}

}  // namespace xray_registration
