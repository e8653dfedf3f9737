// Registers every frame of a recorded session, in order, none dropped.
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

#include "tools/common/bag_frames.h"
#include "tools/common/command_line.h"
#include "tools/common/disturbance.h"
#include "tools/common/json_files.h"
#include "tools/common/message_files.h"
#include "tools/common/progress_bar.h"
#include "tools/common/start_pose.h"
#include "xray_registration/common/statistics.h"
#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/ros/conversions.h"
#include "xray_registration/ros/status_message.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

// As the launch files name the node.
const char* const kPoseTopic = "/xray_registration/pose";
const char* const kStatusTopic = "/xray_registration/status";

struct Arguments {
  std::string ct;
  std::string bag;
  std::string output;
  std::string config;
  std::string views;
  std::string initial_pose;
  std::string initial_pose_topic;
  std::string disturb;
  std::uint64_t seed = 1;
  std::string json;
  std::string overlay;
  std::string device;
  std::string method;
  double target_size_mm = 100.0;
  bool verbose = false;
};

/// What is known about one frame at the end.
struct FrameRecord {
  ros::Time stamp;
  ros::Time received;
  FrameOutcome outcome;
  std::optional<PoseError> error;
};

void checkArguments(const Arguments& arguments) {
  namespace fs = std::filesystem;
  requireWritableParent(arguments.output, "--output");
  if (fs::exists(arguments.output) && fs::equivalent(arguments.output, arguments.bag)) {
    throw ArgumentError("--output is the same file as --bag: " + arguments.bag);
  }
  if (!arguments.json.empty()) requireWritableParent(arguments.json, "--json");
  if (!arguments.overlay.empty()) requireWritableParent(arguments.overlay, "--overlay");
  disturbedPose(RigidTransform::Identity(), arguments.disturb, arguments.seed, Eigen::Vector3d::Zero());
}

NodeParameters parametersOf(const Arguments& arguments, const BagSession& session, const Logger& logger) {
  NodeParameters parameters =
      arguments.config.empty() ? NodeParameters{} : loadParametersYaml(arguments.config, logger);
  parameters.ct.path = arguments.ct;
  parameters.views = viewParameter(session);
  if (!arguments.device.empty()) parameters.device = arguments.device;
  if (!arguments.method.empty()) {
    parameters.registrar.method = arguments.method == "paper" ? Method::kPaper : Method::kFast;
  }
  if (!parameters.frames.fixed.empty()) {
    log(logger, LogLevel::kWarning, "frames/fixed is for the live node; poses are written in the first view's frame");
  }
  return parameters;
}

/// X-ray with the DRR's edges, one picture for each view that took part.
void writeOverlays(const Arguments& arguments, const BagSession& session, const FrameOutcome& outcome,
                   std::size_t frame, RegistrationPipeline* pipeline) {
  if (!outcome.registered) return;
  for (std::size_t i = 0; i < outcome.views.size(); ++i) {
    if (!outcome.views[i]) continue;
    const ViewInput& view = *outcome.views[i];
    const FloatImage drr = pipeline->renderDrr(view.xray->camera, view.T_view_first * outcome.result.T_camera_ct);
    if (drr.empty()) throw std::runtime_error("the DRR for the overlay failed: " + pipeline->fault());
    char number[32];
    std::snprintf(number, sizeof number, "%05zu", frame);
    const std::string& name = session.views()[i].name;
    const auto colour = outcome.result.accepted ? OverlayColour::kAccepted : OverlayColour::kRefused;
    writePng(arguments.overlay + "/" + (name.empty() ? "" : name + "_") + number + ".png",
             toColourMessage(drawOverlay(view.xray->attenuation, view.xray->mask, drr, colour)));
  }
}

/// Poses of one stamp contradict each other in tf, so a stamp is registered once, as in the live node: a view that came
/// late may make a second frame of it.
FrameOutcome registered(const BagSession& session, const BagFrame& frame, std::set<ros::Time>* stamps,
                        RegistrationPipeline* pipeline) {
  if (frame.stamp.isZero() || stamps->insert(frame.stamp).second) {
    return pipeline->process(frame.stamp.toSec(), rawViews(session, frame));
  }
  FrameOutcome outcome;
  outcome.state = pipeline->state();
  outcome.result.reason = "a frame with this stamp was already handled";
  return outcome;
}

std::vector<FrameRecord> registerFrames(const Arguments& arguments, const BagSession& session,
                                        RegistrationPipeline* pipeline) {
  const auto targets = targetGrid(pipeline->centreCt(), arguments.target_size_mm);
  std::vector<FrameRecord> records;
  std::set<ros::Time> stamps;
  ProgressBar progress("registering", session.frameCount());
  for (std::size_t i = 0; i < session.frameCount(); ++i) {
    const BagFrame frame = session.frame(i);
    FrameRecord record{frame.stamp, frame.received, {}, {}};
    record.outcome = registered(session, frame, &stamps, pipeline);
    if (pipeline->state() == TrackingState::kFault) throw std::runtime_error("device failed: " + pipeline->fault());
    if (record.outcome.registered && frame.T_first_ct_true) {
      record.error = poseError(record.outcome.result.T_camera_ct, *frame.T_first_ct_true, targets);
    }
    if (!arguments.overlay.empty()) writeOverlays(arguments, session, record.outcome, i, pipeline);
    record.outcome.views.clear();  // Images are not needed any more.
    records.push_back(std::move(record));
    progress.advanceTo(i + 1);
  }
  return records;
}

/// A message of /tf without the poses of the CT that an earlier run wrote.
tf2_msgs::TFMessage withoutResults(tf2_msgs::TFMessage message, const std::string& camera_frame,
                                   const FrameParameters& frames) {
  const std::string& parent = frames.invert_tf ? frames.ct : camera_frame;
  const std::string& child = frames.invert_tf ? camera_frame : frames.ct;
  const auto isResult = [&](const geometry_msgs::TransformStamped& transform) {
    return transform.header.frame_id == parent && transform.child_frame_id == child;
  };
  auto& all = message.transforms;
  all.erase(std::remove_if(all.begin(), all.end(), isResult), all.end());
  return message;
}

/// Everything but the results of an earlier run, which are replaced.
void copyInput(const std::string& input, const std::string& camera_frame, const FrameParameters& frames,
               rosbag::Bag* output) {
  rosbag::Bag bag(input, rosbag::bagmode::Read);
  rosbag::View all(bag);
  for (const rosbag::MessageInstance& message : all) {
    if (message.getTopic() == kPoseTopic || message.getTopic() == kStatusTopic) continue;
    const auto transforms =
        message.getTopic() == "/tf" ? message.instantiate<tf2_msgs::TFMessage>() : tf2_msgs::TFMessagePtr();
    if (!transforms) {
      output->write(message.getTopic(), message.getTime(), message, message.getConnectionHeader());
      continue;
    }
    const tf2_msgs::TFMessage kept = withoutResults(*transforms, camera_frame, frames);
    if (!kept.transforms.empty()) output->write("/tf", message.getTime(), kept, message.getConnectionHeader());
  }
}

RegistrationStatus statusOf(const FrameRecord& record, const std_msgs::Header& header,
                            const RegistrationPipeline& pipeline) {
  RegistrationStatus status = statusMessage(record.outcome, header);
  status.latency = record.outcome.total_ms * 1e-3;
  status.device = pipeline.deviceName();
  status.ct = pipeline.ctName();
  return status;
}

void writeOutput(const Arguments& arguments, const BagSession& session, const std::vector<FrameRecord>& records,
                 const RegistrationPipeline& pipeline) {
  rosbag::Bag output(arguments.output, rosbag::bagmode::Write);
  output.setCompression(rosbag::compression::LZ4);
  const FrameParameters& frames = pipeline.parameters().frames;
  copyInput(arguments.bag, session.views().front().frame_id, frames, &output);
  std::uint64_t registered = 0;
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const FrameRecord& record = records[i];
    const RegistrationResult& result = record.outcome.result;
    std_msgs::Header header;
    header.stamp = record.stamp;
    header.frame_id = session.views().front().frame_id;
    RegistrationStatus status = statusOf(record, header, pipeline);
    if (status.registered) ++registered;
    (result.accepted ? accepted : refused) += 1;
    status.frames_received = i + 1;
    status.frames_registered = registered;
    status.frames_accepted = accepted;
    status.frames_refused = refused;
    output.write(kStatusTopic, record.received, status);
    if (!result.accepted) continue;

    geometry_msgs::PoseWithCovarianceStamped pose;
    pose.header = header;
    pose.pose = toPoseWithCovariance(result.T_camera_ct, result.covariance, pipeline.centreCt());
    output.write(kPoseTopic, record.received, pose);

    if (!frames.publish_tf) continue;
    tf2_msgs::TFMessage tf;
    tf.transforms.resize(1);
    tf.transforms[0].header = header;
    tf.transforms[0].child_frame_id = frames.ct;
    tf.transforms[0].transform = toTransform(frames.invert_tf ? result.T_camera_ct.inverse() : result.T_camera_ct);
    if (frames.invert_tf) std::swap(tf.transforms[0].header.frame_id, tf.transforms[0].child_frame_id);
    output.write("/tf", record.received, tf);
  }
  output.close();
}

void writeResults(const std::string& path, const RigidTransform& T_camera_ct_start, const Eigen::Vector3d& centre_ct_mm,
                  const std::vector<FrameRecord>& records) {
  nlohmann::json frames = nlohmann::json::array();
  for (const auto& record : records) {
    const RegistrationResult& result = record.outcome.result;
    nlohmann::json frame = {{"stamp", record.stamp.toSec()},   {"accepted", result.accepted},
                            {"T_camera_ct", nullptr},          {"iterations", result.iterations},
                            {"solve_ms", result.solve_ms},     {"total_ms", record.outcome.total_ms},
                            {"similarity", result.similarity}, {"state", toString(record.outcome.state)},
                            {"reason", result.reason},         {"suspicions", toJson(result.suspicions)}};
    if (record.outcome.registered) {
      frame["T_camera_ct"] = toJson(result.T_camera_ct);
      frame["covariance"] = toPoseWithCovariance(result.T_camera_ct, result.covariance, centre_ct_mm).covariance;
    }
    if (record.error) {
      frame["mtre"] = record.error->mtre_mm;
      frame["inplane"] = record.error->inplane_mm;
    }
    frames.push_back(frame);
  }
  writeJson(path, {{"start", toJson(T_camera_ct_start)}, {"frames", frames}});
}

void printSummary(const std::vector<FrameRecord>& records) {
  std::vector<double> total_ms, mtre, inplane;
  std::size_t accepted = 0;
  std::string last_reason;
  for (const auto& record : records) {
    total_ms.push_back(record.outcome.total_ms);
    if (!record.outcome.result.accepted) {
      last_reason = record.outcome.result.reason;
      continue;
    }
    ++accepted;
    if (!record.error) continue;
    mtre.push_back(record.error->mtre_mm);
    inplane.push_back(record.error->inplane_mm);
  }
  std::printf("%zu of %zu frames accepted, median %.1f ms a frame\n", accepted, records.size(), median(total_ms));
  if (!mtre.empty()) {
    std::printf(
        "against the ground truth: mTRE median %.3f mm, worst %.3f mm; in-plane median %.3f mm, worst %.3f mm\n",
        median(mtre), largest(mtre), median(inplane), largest(inplane));
  }
  if (accepted < records.size()) std::printf("last refusal: %s\n", last_reason.c_str());
}

void run(const Arguments& arguments) {
  checkArguments(arguments);
  const Logger logger = standardErrorLogger("register_bag", arguments.verbose);
  NodeParameters probe = arguments.config.empty() ? NodeParameters{} : loadParametersYaml(arguments.config);
  BagSessionOptions options;
  options.views = arguments.views.empty() ? probe.views : splitList(arguments.views);
  options.tolerance_s = probe.sync.tolerance_s;
  const BagSession session(arguments.bag, options, logger);
  const NodeParameters parameters = parametersOf(arguments, session, logger);
  const RigidTransform undisturbed =
      startPose({arguments.initial_pose, arguments.initial_pose_topic, arguments.config}, session, parameters);

  RegistrationPipeline pipeline(parameters, logger);
  pipeline.openDevice();
  pipeline.loadCt(arguments.ct, parameters.ct.read.series_uid);
  pipeline.dropCt();
  const RigidTransform start = disturbedPose(undisturbed, arguments.disturb, arguments.seed, pipeline.centreCt());
  pipeline.setPose(start);
  if (!arguments.overlay.empty()) std::filesystem::create_directory(arguments.overlay);

  const auto records = registerFrames(arguments, session, &pipeline);
  writeOutput(arguments, session, records, pipeline);
  if (!arguments.json.empty()) writeResults(arguments.json, start, pipeline.centreCt(), records);
  printSummary(records);
}

void addOptions(CLI::App& app, Arguments& arguments) {
  app.add_option("--ct", arguments.ct, "CT: NIfTI, NRRD, MetaImage or a DICOM folder")
      ->required()
      ->check(CLI::ExistingPath);
  app.add_option("--bag", arguments.bag, "recorded session")->required()->check(CLI::ExistingFile);
  app.add_option("--output", arguments.output, "bag with pose, status and tf beside the inputs")->required();
  app.add_option("--config", arguments.config, "the node's parameters, YAML")->check(CLI::ExistingFile);
  app.add_option("--views", arguments.views, "a,b; default: all views in the bag");
  auto* file = app.add_option("--initial-pose", arguments.initial_pose,
                              "start in the first view's frame, YAML (docs/formats.md)")
                   ->check(CLI::ExistingFile);
  app.add_option(
         "--initial-pose-topic", arguments.initial_pose_topic,
         "start from the first PoseStamped, PoseWithCovarianceStamped or transform to the CT on this topic of the bag")
      ->excludes(file);
  app.add_option("--disturb", arguments.disturb,
                 "DEG,MM: turn the start by so much about the CT's centre and move it by so much (for experiments)");
  app.add_option("--seed", arguments.seed, "axis and direction of --disturb")->capture_default_str();
  app.add_option("--json", arguments.json, "one entry for each frame (docs/formats.md)");
  app.add_option("--overlay", arguments.overlay, "folder for PNGs: X-ray, edges of the DRR, what was masked");
  app.add_option("--device", arguments.device, "auto, gpu, cpu, or a part of the device's name");
  app.add_option("--method", arguments.method, "fast or paper")->check(CLI::IsMember({"fast", "paper"}));
  app.add_option("--target-size", arguments.target_size_mm, "side of the targets' cube for the errors, mm")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
  app.add_flag("--verbose", arguments.verbose, "say what is done");
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Registers every frame of a bag to a CT, in order, none dropped.", "register_bag");
  addOptions(app, arguments);
  return runTool(app, argc, argv, [&] { run(arguments); });
}
