// How far the poses of one recording lie from those of another: a live run from the ground truth, or one run from
// another.
#include <cstdio>
#include <map>

#include "tools/common/command_line.h"
#include "tools/common/ct_options.h"
#include "tools/common/json_files.h"
#include "xray_registration/common/statistics.h"
#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/ros/bag_session.h"
#include "xray_registration/volume/volume_io.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

struct Arguments {
  std::string ct;
  VolumeReadOptions read;
  std::string bag;
  std::string topic = "/xray_registration/pose";
  std::string reference;
  std::string reference_topic;
  std::string frame = "ct";
  std::string json;
  double target_size_mm = 100.0;
};

struct Compared {
  ros::Time stamp;
  PoseError error;
};

/// Pairs by their stamps. @throws std::runtime_error when two of a pair are in different frames.
std::vector<Compared> compared(const std::vector<StampedPose>& found, const std::vector<StampedPose>& reference,
                               const std::vector<Eigen::Vector3d>& targets_ct_mm) {
  std::map<ros::Time, const StampedPose*> by_stamp;
  for (const StampedPose& pose : found) by_stamp[pose.stamp] = &pose;
  std::vector<Compared> pairs;
  for (const StampedPose& pose : reference) {
    const auto other = by_stamp.find(pose.stamp);
    if (other == by_stamp.end()) continue;
    if (other->second->frame_id != pose.frame_id) {
      throw std::runtime_error("the poses are in frame '" + other->second->frame_id +
                               "' and those of the reference in '" + pose.frame_id + "'");
    }
    pairs.push_back({pose.stamp, poseError(other->second->T_frame_ct, pose.T_frame_ct, targets_ct_mm)});
  }
  return pairs;
}

void run(const Arguments& arguments) {
  if (!arguments.json.empty()) requireWritableParent(arguments.json, "--json");
  const auto found = readPoses(arguments.bag, arguments.topic, arguments.frame);
  const auto reference = readPoses(arguments.reference, arguments.reference_topic, arguments.frame);
  // Its place alone counts here.
  VolumeReadOptions read = arguments.read;
  read.check_values = false;
  const Eigen::Vector3d centre_ct_mm = readVolume(arguments.ct, read, {}).grid.centreCt();
  const auto pairs = compared(found, reference, targetGrid(centre_ct_mm, arguments.target_size_mm));

  std::vector<double> mtre_mm, inplane_mm;
  nlohmann::json frames = nlohmann::json::array();
  for (const auto& [stamp, error] : pairs) {
    mtre_mm.push_back(error.mtre_mm);
    inplane_mm.push_back(error.inplane_mm);
    frames.push_back({{"stamp", stamp.toSec()}, {"mtre", error.mtre_mm}, {"inplane", error.inplane_mm}});
  }
  std::printf(
      "%zu of %zu poses of the reference compared: mTRE median %.3f mm, worst %.3f mm; in-plane median %.3f mm, "
      "worst %.3f mm\n",
      pairs.size(), reference.size(), median(mtre_mm), largest(mtre_mm), median(inplane_mm), largest(inplane_mm));
  if (!arguments.json.empty()) {
    const nlohmann::json summary = {{"reference_poses", reference.size()},
                                    {"compared", pairs.size()},
                                    {"mtre", toJson(percentiles(mtre_mm))},
                                    {"inplane", toJson(percentiles(inplane_mm))}};
    writeJson(arguments.json, {{"frames", frames}, {"summary", summary}});
  }
  if (pairs.empty()) throw std::runtime_error("no pose has the stamp of one of the reference");
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Compares the poses of the CT in a recording with those of another that have the same stamps.",
               "compare_poses");
  app.add_option("--ct", arguments.ct, "CT whose centre the targets stand around")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option("--bag", arguments.bag, "recording whose poses are judged")->required()->check(CLI::ExistingFile);
  app.add_option("--topic", arguments.topic, "of PoseStamped, PoseWithCovarianceStamped or tf")->capture_default_str();
  app.add_option("--reference", arguments.reference, "recording that they are compared with")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--reference-topic", arguments.reference_topic, "of the same types")->required();
  app.add_option("--frame", arguments.frame, "the CT's frame, in a topic of tf")->capture_default_str();
  app.add_option("--target-size", arguments.target_size_mm, "side of the targets' cube, mm")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
  addCtReadOptions(app, &arguments.read);
  app.add_option("--json", arguments.json, "one entry for each pair, and the summary (docs/formats.md)");
  return runTool(app, argc, argv, [&] { run(arguments); });
}
