#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "xray_registration/ros/registration_pipeline.h"
#include "xray_registration/ros/view_synchroniser.h"

namespace xray_registration {

/// A second thread that prepares the frame that waits while another one is being registered. Whoever takes a frame gets
/// what was prepared of it, or prepares it then; no frame is prepared twice, and a newer frame replaces one that waits.
class FramePreparer {
 public:
  using Prepare = std::function<PreparedFrame(const FrameMessages&)>;

  /// `prepare` runs in the second thread and in the callers of take(), never for two frames at once in the former.
  explicit FramePreparer(Prepare prepare);
  ~FramePreparer();

  /// Asks for a frame ahead of its turn. Does not wait.
  void offer(const FrameMessages& frame);

  /// The prepared frame. Waits only for a preparation of this very frame that is under way.
  PreparedFrame take(const FrameMessages& frame);

  /// Ends the thread; take() goes on working without it. Called by the destructor too.
  void stop();

 private:
  void run();

  const Prepare prepare_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<FrameMessages> waiting_;
  std::optional<FrameMessages> current_;   ///< Being prepared.
  std::optional<FrameMessages> finished_;  ///< Whose preparation `prepared_` is.
  PreparedFrame prepared_;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace xray_registration
