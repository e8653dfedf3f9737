#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

namespace xray_registration {

/// What a worker thread lives on: one slot that holds the newest frame, and a queue of jobs that come before it. A
/// frame that waits is replaced by a newer one, so that the worker is never more than one frame behind. All methods may
/// be called from any thread.
template <typename Frame>
class FrameMailbox {
 public:
  using Job = std::function<void()>;

  /// Stores a frame. Returns the one that it replaces: nobody will look at that one. Returns `frame` itself when the
  /// mailbox is closed.
  std::optional<Frame> put(Frame frame) {
    std::optional<Frame> replaced;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (closed_) return frame;
      replaced = std::exchange(frame_, std::move(frame));
    }
    changed_.notify_one();
    return replaced;
  }

  /// Adds a job; false when the mailbox is closed, then the job will not run.
  bool post(Job job) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (closed_) return false;
      jobs_.push_back(std::move(job));
    }
    changed_.notify_one();
    return true;
  }

  /// Takes the waiting frame out, so that nobody handles it.
  std::optional<Frame> clear() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(frame_, std::nullopt);
  }

  /// Waits for a job or a frame and takes it; jobs first, in their order. False when the mailbox was closed. With a
  /// deadline neither may have come.
  bool take(Job* job, std::optional<Frame>* frame,
            const std::optional<std::chrono::steady_clock::time_point>& deadline = {}) {
    *job = nullptr;
    frame->reset();
    std::unique_lock<std::mutex> lock(mutex_);
    const auto has_something = [this] { return closed_ || frame_ || !jobs_.empty(); };
    if (deadline) {
      changed_.wait_until(lock, *deadline, has_something);
    } else {
      changed_.wait(lock, has_something);
    }
    if (closed_) return false;
    if (!jobs_.empty()) {
      *job = std::move(jobs_.front());
      jobs_.pop_front();
    } else {
      *frame = std::exchange(frame_, std::nullopt);
    }
    return true;
  }

  /// Ends every wait; what is still inside is destroyed without being handled.
  void close() {
    std::deque<Job> jobs;  // Destroyed outside the lock: a job may hold a promise that somebody waits for.
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
      frame_.reset();
      jobs.swap(jobs_);
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Frame> frame_;
  std::deque<Job> jobs_;
  bool closed_ = false;
};

}  // namespace xray_registration
