#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "xray_registration/registration/tracker.h"

namespace xray_registration {

/// One X-ray camera as the node sees it.
struct InputFacts {
  std::string image_topic;
  std::string info_topic;
  int image_publishers = 0;
  std::uint64_t images = 0;  ///< That came since the start.
  std::uint64_t infos = 0;
};

/// What a node knows that somebody who has just started it may not.
struct ConsoleFacts {
  std::vector<InputFacts> inputs;
  TrackingState state = TrackingState::kWaitingForCt;
  bool tracks = true;            ///< Images are to come all the time (mode track).
  bool waits_for_clock = false;  ///< Simulated time is set, and has not begun.
  std::string initialpose_topic;
  std::string set_initial_pose_service;
};

/// Finds out what to say to help somebody whose node does nothing: each thing once for each time that it lasts, and not
/// twice within a minute. Not thread-safe.
class ConsoleHelp {
 public:
  using Clock = std::chrono::steady_clock;
  /// How long something has to last before it is said: long enough for everybody to start.
  static constexpr std::chrono::seconds kPatience{5};
  static constexpr std::chrono::seconds kPause{60};

  /// To be called every second or so. `image_topics` is asked for the topics of images that there are, when they are to
  /// be named: that may take long.
  std::vector<std::string> advise(const ConsoleFacts& facts, Clock::time_point now,
                                  const std::function<std::vector<std::string>()>& image_topics);

 private:
  struct Episode {
    std::optional<Clock::time_point> since;  ///< Nothing while it is not so.
    bool said = false;                       ///< In this episode.
    std::optional<Clock::time_point> said_at;
  };
  struct SeenInput {
    std::uint64_t images = 0;
    std::uint64_t infos = 0;
  };

  bool isDue(const std::string& what, bool holds, Clock::time_point now);

  std::map<std::string, Episode> episodes_;
  std::map<std::string, SeenInput> seen_;  ///< At the last call, by the image's topic.
};

}  // namespace xray_registration
