#pragma once

#include <std_msgs/Header.h>

#include <atomic>
#include <chrono>
#include <future>
#include <optional>
#include <string>

#include "xray_registration/registration/registrar.h"
#include "xray_registration/ros/view_synchroniser.h"

namespace xray_registration {

/// What ~localize asks of the worker, and what it hears from it. Whoever asks may look at the atomic members, and set
/// `cancelled`, at any time; the rest is the worker's once the task is handed over.
struct WideSearchTask {
  /// What came of it.
  struct Answer {
    bool accepted = false;
    std::string message;      ///< Why not.
    std_msgs::Header header;  ///< Of the frame; its frame_id is the first view's optical frame.
    RigidTransform T_camera_ct = RigidTransform::Identity();
    double similarity = 0.0;
  };

  std::optional<RigidTransform> T_frame_ct_centre;  ///< None: the present pose, and from nothing without one.
  std::string frame_id;                             ///< Of the centre.
  double rotation_rad = 0.0;
  double translation_mm = 0.0;
  std::chrono::steady_clock::time_point deadline = std::chrono::steady_clock::time_point::max();

  std::atomic<bool> cancelled{false};
  std::atomic<double> progress{0.0};
  std::atomic<double> best_similarity{-1.0};

  FrameMessages frame;  ///< That is looked at.
  std::promise<Answer> promise;
};

}  // namespace xray_registration
