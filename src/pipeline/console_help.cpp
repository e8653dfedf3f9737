#include "xray_registration/pipeline/console_help.h"

#include <algorithm>

namespace xray_registration {
namespace {

constexpr std::size_t kTopicsNamed = 6;

/// "; image topics there are: /a, /b (image:=/a)"
std::string otherTopics(std::vector<std::string> topics, const std::string& missing) {
  topics.erase(std::remove(topics.begin(), topics.end(), missing), topics.end());
  if (topics.empty()) return "; no other topic has images either";
  std::sort(topics.begin(), topics.end());
  std::string text = "; topics of images that there are: ";
  for (std::size_t i = 0; i < std::min(topics.size(), kTopicsNamed); ++i) text += (i > 0 ? ", " : "") + topics[i];
  if (topics.size() > kTopicsNamed) text += ", ...";
  return text + "; take one by image:=" + topics.front() + " of register.launch, or by remapping";
}

std::string silence(const InputFacts& input, const std::function<std::vector<std::string>()>& image_topics) {
  if (input.image_publishers > 0) return "no image comes on " + input.image_topic + ", though somebody publishes there";
  return "no image comes on " + input.image_topic + ": nobody publishes there" +
         otherTopics(image_topics(), input.image_topic);
}

std::string noInfo(const InputFacts& input) {
  return "images come on " + input.image_topic + ", but no camera_info on " + input.info_topic +
         ": without it they cannot be registered; publish one with the stamp of each image";
}

std::string severalPublishers(const InputFacts& input) {
  return std::to_string(input.image_publishers) + " nodes publish on " + input.image_topic +
         ": images of the one that lags behind are refused (rostopic info " + input.image_topic + " names them)";
}

std::string noStart(const ConsoleFacts& facts) {
  return "no pose of the CT is known, so nothing is registered; give a rough one by the parameter initial_pose (of "
         "register.launch: initial_pose:=\"{position: [x, y, z], orientation: [x, y, z, w]}\", metres, in the X-ray's "
         "optical frame), on the topic " +
         facts.initialpose_topic + ", or by the service " + facts.set_initial_pose_service;
}

}  // namespace

bool ConsoleHelp::isDue(const std::string& what, bool holds, Clock::time_point now) {
  Episode& episode = episodes_[what];
  if (!holds) {
    episode.since.reset();
    episode.said = false;
    return false;
  }
  if (!episode.since) episode.since = now;
  if (episode.said || now - *episode.since < kPatience) return false;
  if (episode.said_at && now - *episode.said_at < kPause) return false;
  episode.said = true;
  episode.said_at = now;
  return true;
}

std::vector<std::string> ConsoleHelp::advise(const ConsoleFacts& facts, Clock::time_point now,
                                             const std::function<std::vector<std::string>()>& image_topics) {
  std::vector<std::string> advice;
  bool some_images = false;
  if (isDue("clock", facts.waits_for_clock, now)) {
    advice.emplace_back(
        "use_sim_time is set, and nothing comes on /clock: play the bag with --clock, or set use_sim_time to false");
  }
  for (const InputFacts& input : facts.inputs) {
    SeenInput& seen = seen_[input.image_topic];
    const bool images = input.images > seen.images;
    const bool infos = input.infos > seen.infos;
    seen = {input.images, input.infos};
    some_images = some_images || images;
    const bool silent = !images && (facts.tracks || input.images == 0);
    if (isDue("silent " + input.image_topic, silent, now)) advice.push_back(silence(input, image_topics));
    if (isDue("no info " + input.image_topic, images && !infos, now)) advice.push_back(noInfo(input));
    if (isDue("several " + input.image_topic, input.image_publishers > 1, now)) {
      advice.push_back(severalPublishers(input));
    }
  }
  const bool waits = facts.state == TrackingState::kWaitingForPose && some_images;
  if (isDue("start", waits, now)) advice.push_back(noStart(facts));
  return advice;
}

}  // namespace xray_registration
