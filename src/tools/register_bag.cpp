// Registers every frame of a recorded session, in order, none dropped.
#include <cstdio>
#include <filesystem>

#include "tools/common/bag_frames.h"
#include "tools/common/command_line.h"
#include "tools/common/disturbance.h"
#include "tools/common/json_files.h"
#include "tools/common/message_files.h"
#include "tools/common/progress_bar.h"
#include "tools/common/start_pose.h"
#include "tools/register_bag/frame_filter.h"
#include "tools/register_bag/frame_record.h"
#include "tools/register_bag/motion.h"
#include "tools/register_bag/output_bag.h"
#include "tools/register_bag/report.h"
#include "xray_registration/common/names.h"
#include "xray_registration/evaluation/trials.h"
#include "xray_registration/ros/conversions.h"

namespace {

using namespace xray_registration;
using namespace xray_registration::tools;

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
  std::string csv;
  std::string knee;
  std::string overlay;
  std::string device;
  std::string method;
  double target_size_mm = 100.0;
  bool verbose = false;
};

void checkArguments(const Arguments& arguments) {
  namespace fs = std::filesystem;
  requireWritableParent(arguments.output, "--output");
  if (fs::exists(arguments.output) && fs::equivalent(arguments.output, arguments.bag)) {
    throw ArgumentError("--output is the same file as --bag: " + arguments.bag);
  }
  if (!arguments.json.empty()) requireWritableParent(arguments.json, "--json");
  if (!arguments.csv.empty()) requireWritableParent(arguments.csv, "--csv");
  if (!arguments.overlay.empty()) requireWritableParent(arguments.overlay, "--overlay");
  disturbedPose(RigidTransform::Identity(), arguments.disturb, arguments.seed, Eigen::Vector3d::Zero());
}

NodeParameters parametersOf(const Arguments& arguments, const BagSession& session, const Logger& logger) {
  NodeParameters parameters =
      arguments.config.empty() ? NodeParameters{} : loadParametersYaml(arguments.config, logger);
  parameters.ct.path = arguments.ct;
  if (arguments.ct.empty() && parameters.needsCt()) {
    throw ArgumentError("--ct is required, unless every body of the configuration has its own ct or mesh");
  }
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

/// X-ray with the edges of CT and bodies, one picture for each view that took part.
void writeOverlays(const Arguments& arguments, const BagSession& session, const FrameOutcome& outcome,
                   std::size_t frame, RegistrationPipeline* pipeline) {
  if (!outcome.registered) return;
  for (std::size_t i = 0; i < outcome.views.size(); ++i) {
    if (!outcome.views[i]) continue;
    const ViewInput& view = *outcome.views[i];
    const DrrParts parts = pipeline->renderParts(view, outcome.result);
    const auto lines = overlayLines(parts, outcome.result, pipeline->parameters().bodies);
    if (lines.empty()) throw std::runtime_error("the DRR for the overlay failed: " + pipeline->fault());
    char number[32];
    std::snprintf(number, sizeof number, "%05zu", frame);
    const std::string& name = session.views()[i].name;
    writePng(arguments.overlay + "/" + (name.empty() ? "" : asFileName(name) + "_") + number + ".png",
             toColourMessage(drawOverlay(view.xray->attenuation.values(), view.xray->mask, lines)));
  }
}

FrameOutcome registered(const BagSession& session, const BagFrame& frame, FrameFilter* filter,
                        RegistrationPipeline* pipeline) {
  FrameOutcome outcome;
  outcome.result.reason = filter->problem(frame, pipeline);
  if (outcome.result.reason.empty()) {
    outcome = pipeline->process(frame.stamp.toSec(), rawViews(session, frame));
    if (outcome.registered) filter->noteLookedAt(frame.stamp);
    return outcome;
  }
  outcome.state = pipeline->state();
  for (const FollowedBodyInfo& body : pipeline->followedBodies()) {
    outcome.result.bodies.emplace_back().name = body.name;
    outcome.result.bodies.back().reason = outcome.result.reason;
  }
  return outcome;
}

void addErrors(const BagFrame& frame, const std::vector<Eigen::Vector3d>& targets_ct_mm, FrameRecord* record) {
  const RegistrationResult& result = record->outcome.result;
  if (record->outcome.registered && frame.T_first_ct_true) {
    record->error = poseError(result.T_camera_ct, *frame.T_first_ct_true, targets_ct_mm);
  }
  for (const BodyResult& body : result.bodies) {
    const auto truth = frame.T_first_bodies_true.find(body.name);
    if (!body.solved || truth == frame.T_first_bodies_true.end()) continue;
    record->body_errors[body.name] =
        poseError(body.T_camera_body, truth->second, targetGrid(body.centre_ct_mm, kBodyTargetSizeMm));
  }
}

std::vector<FrameRecord> registerFrames(const Arguments& arguments, const BagSession& session,
                                        RegistrationPipeline* pipeline) {
  const auto targets = targetGrid(pipeline->centreCt(), arguments.target_size_mm);
  std::vector<FrameRecord> records;
  FrameFilter filter(session, pipeline->parameters());
  ProgressBar progress("registering", session.frameCount());
  for (std::size_t i = 0; i < session.frameCount(); ++i) {
    const BagFrame frame = session.frame(i);
    FrameRecord record{frame.stamp, frame.received, filter.frameId(frame), {}, {}, {}};
    record.outcome = registered(session, frame, &filter, pipeline);
    if (pipeline->state() == TrackingState::kFault) throw std::runtime_error("device failed: " + pipeline->fault());
    addErrors(frame, targets, &record);
    if (!arguments.overlay.empty()) writeOverlays(arguments, session, record.outcome, i, pipeline);
    record.outcome.views.clear();  // Images are not needed any more.
    records.push_back(std::move(record));
    progress.advanceTo(i + 1);
  }
  return records;
}

void load(const Arguments& arguments, RegistrationPipeline* pipeline) {
  pipeline->openDevice();
  if (arguments.ct.empty()) {
    pipeline->loadBodies();
  } else {
    pipeline->loadCt(arguments.ct, pipeline->parameters().ct.read.series_uid);
    pipeline->dropCt();
  }
}

/// Where the session starts: the CT (or the first body), and the bodies that have starts of their own. Returns the
/// first. --disturb is for all of them.
RigidTransform setStarts(const Arguments& arguments, const BagSession& session, RegistrationPipeline* pipeline) {
  const StartSource source = {arguments.initial_pose, arguments.initial_pose_topic, arguments.config};
  const auto disturbed = [&arguments](const RigidTransform& pose, const Eigen::Vector3d& centre_mm) {
    return disturbedPose(pose, arguments.disturb, arguments.seed, centre_mm);
  };
  RegistrationPipeline::BodyPoses bodies = bodyStartPoses(source, session, pipeline->parameters());
  for (const FollowedBodyInfo& body : pipeline->followedBodies()) {
    const auto start = bodies.find(body.name);
    if (start != bodies.end()) start->second = disturbed(start->second, body.centre_mm);
  }
  RigidTransform start = disturbed(startPose(source, session, pipeline->parameters()), pipeline->centreCt());
  pipeline->setPose(start, bodies);
  return start;
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
  // A start that is missing is said before anything long begins.
  startPose({arguments.initial_pose, arguments.initial_pose_topic, arguments.config}, session, parameters);

  RegistrationPipeline pipeline(parameters, logger);
  load(arguments, &pipeline);
  std::optional<MotionTable> motion;
  if (!arguments.csv.empty()) motion.emplace(tableSetup(pipeline, arguments.knee, logger));
  const RigidTransform start = setStarts(arguments, session, &pipeline);
  if (!arguments.overlay.empty()) std::filesystem::create_directory(arguments.overlay);

  const auto records = registerFrames(arguments, session, &pipeline);
  writeOutputBag(arguments.output, session, records, pipeline);
  if (!arguments.json.empty()) writeJson(arguments.json, resultsJson(start, pipeline.centreCt(), records));
  if (motion) motion->write(arguments.csv, tableFrames(records));
  printSummary(records);
  requireSomeAccepted(records);
}

void addOptions(CLI::App& app, Arguments& arguments) {
  app.add_option("--ct", arguments.ct,
                 "CT: NIfTI, NRRD, MetaImage or a DICOM folder; not needed when every body has its own")
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
         "start from the first PoseStamped, PoseWithCovarianceStamped or transform to the CT on this topic of the bag; "
         "of a body with a CT or mesh of its own, from TOPIC/<body>")
      ->excludes(file);
  app.add_option("--disturb", arguments.disturb,
                 "DEG,MM: turn the start by so much about the CT's centre and move it by so much (for experiments)");
  app.add_option("--seed", arguments.seed, "axis and direction of --disturb")->capture_default_str();
  app.add_option("--json", arguments.json, "one entry for each frame (docs/formats.md)");
  auto* csv = app.add_option("--csv", arguments.csv, "the motion as a table for spreadsheets (docs/formats.md)");
  app.add_option("--knee", arguments.knee, "FEMUR,TIBIA[,left]: with --csv, the joint angles of these two bodies")
      ->needs(csv);
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
