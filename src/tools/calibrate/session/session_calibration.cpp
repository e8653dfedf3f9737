#include "tools/calibrate/session/session_calibration.h"

#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "tools/calibrate/session/calibrated_bag.h"
#include "tools/calibrate/session/frame_choice.h"
#include "tools/calibrate/session/motion_picture.h"
#include "tools/calibrate/session/told_session.h"
#include "tools/common/bag_frames.h"
#include "tools/common/command_line.h"
#include "tools/common/progress_bar.h"
#include "tools/common/start_pose.h"
#include "tools/common/wrong_option.h"
#include "xray_registration/ros/node_parameters.h"

namespace xray_registration::tools {
namespace {

namespace fs = std::filesystem;

/// About as many evaluations of a frame as a calibration takes, for the progress bar.
constexpr std::size_t kUsualEvaluations = 50;

NodeParameters parametersOf(const SessionArguments& arguments, const Logger& logger) {
  try {
    NodeParameters parameters;
    if (!arguments.config.empty()) parameters = loadParametersYaml(arguments.config, logger);
    if (!arguments.views.empty()) parameters.views = splitList(arguments.views);
    if (!arguments.device.empty()) parameters.device = arguments.device;
    parameters.registrar.method = Method::kFast;
    // A wrong set-up is what is looked for, not what a frame is refused for.
    parameters.registrar.check_every = 0;
    parameters.sync.allow_missing_view = false;
    validate(parameters);
    return parameters;
  } catch (const ParameterError& error) {
    throw ArgumentError(error.what());
  }
}

void checkArguments(const SessionArguments& arguments) {
  if (!arguments.json.empty()) requireWritableParent(arguments.json, "--json");
  const fs::path bag = fs::path(arguments.output) / "calibrated.bag";
  if (arguments.write_bag && fs::exists(bag) && fs::equivalent(bag, arguments.bag)) {
    throw ArgumentError("--write-bag would overwrite --bag: " + bag.string());
  }
}

void loadCt(const SessionArguments& arguments, const std::vector<WrongInput>& wrong, const Logger& logger,
            RegistrationPipeline* pipeline) {
  pipeline->openDevice();
  Volume ct = readVolume(arguments.ct, pipeline->parameters().ct.read, logger);
  tellWrong(wrong, &ct);
  pipeline->setCt(std::move(ct));
  pipeline->dropCt();
}

FrameChoice registerFrames(const SessionArguments& arguments, const ToldSession& session, const RigidTransform& start,
                           RegistrationPipeline* pipeline) {
  FrameChoice choice = chooseFrames(session, start, static_cast<std::size_t>(arguments.frames), pipeline);
  if (choice.frames.empty()) {
    throw std::runtime_error(
        arguments.bag + ": no frame could be registered, so nothing can be calibrated; the last: " + choice.why_failed +
        ". Give a better --initial-pose");
  }
  std::printf("%s: %zu of %zu frames used", arguments.bag.c_str(), choice.frames.size(), choice.tried);
  if (choice.alike > 0) std::printf("; %zu left out for others whose poses differ more", choice.alike);
  if (choice.failed > 0) std::printf("; %zu not registered (%s)", choice.failed, choice.why_failed.c_str());
  std::printf("\n");
  return choice;
}

GeometryCalibration calibrate(const FrameChoice& choice, ToldSession* session, Engine* engine) {
  std::vector<RigidTransform> poses;
  for (const RegisteredFrame& frame : choice.frames) poses.push_back(frame.T_camera_ct);
  const std::vector<ViewGeometry> told = toldGeometry(session->raw(choice.frames.front().index));
  ProgressBar bar("calibrating", kUsualEvaluations * poses.size());
  std::size_t done = 0;
  return calibrateGeometry(
      engine,
      [&](std::size_t frame, const std::vector<ViewGeometry>& geometry) {
        return session->views(choice.frames[frame].index, geometry);
      },
      poses, told, {}, [&] { bar.advanceTo(std::min(++done, kUsualEvaluations * poses.size())); });
}

std::vector<CalibratedSessionView> viewsOf(const ToldSession& session, std::size_t frame,
                                           const GeometryCalibration& found) {
  std::vector<CalibratedSessionView> views;
  const std::vector<RawView> told = session.raw(frame);
  for (std::size_t i = 0; i < told.size(); ++i) {
    views.push_back({session.bag().views()[i], told[i].calibration, told[i].T_view_first, found.views[i]});
  }
  return views;
}

std::string folderOf(const SessionArguments& arguments) {
  std::error_code error;
  fs::create_directories(arguments.output, error);
  if (!fs::is_directory(arguments.output)) {
    throw std::runtime_error(arguments.output + ": the folder cannot be made: " + error.message());
  }
  return arguments.output;
}

void writeAll(const SessionArguments& arguments, const FrameChoice& choice, const GeometryCalibration& found,
              ToldSession* session) {
  const std::size_t first = choice.frames.front().index;
  const std::vector<CalibratedSessionView> views = viewsOf(*session, first, found);
  printTable(views);
  std::printf("likeness of X-ray and DRR: %.4f before, %.4f after%s\n", found.similarity_before, found.similarity_after,
              found.converged ? "" : "; the solution did not come to rest");
  const std::string folder = folderOf(arguments);
  std::vector<std::string> files = writeFiles(folder, views);
  std::vector<ViewGeometry> geometry;
  std::vector<std::string> names;
  for (const CalibratedSessionView& view : views) {
    geometry.push_back(view.found.geometry);
    names.push_back(view.bag.name);
  }
  files.push_back((fs::path(folder) / "residual_motion.png").string());
  drawResidualMotion(files.back(), session->views(first, geometry), names, found);
  if (arguments.write_bag) {
    files.push_back((fs::path(folder) / "calibrated.bag").string());
    writeCalibratedBag(arguments.bag, files.back(), views);
  }
  if (!arguments.json.empty()) writeReport(arguments.json, views, found, choice.tried);
  std::string all;
  for (const std::string& file : files) all += (all.empty() ? "" : ", ") + file;
  std::printf("written: %s\n", all.c_str());
}

}  // namespace

void calibrateFromSession(const SessionArguments& arguments) {
  const Logger logger = standardErrorLogger("calibrate", arguments.verbose);
  checkArguments(arguments);
  const std::vector<WrongInput> wrong = wrongInputs(arguments.wrong);
  NodeParameters parameters = parametersOf(arguments, logger);
  BagSessionOptions options;
  options.views = parameters.views;
  options.tolerance_s = parameters.sync.tolerance_s;
  const BagSession bag(arguments.bag, options, logger);
  parameters.views = viewParameter(bag);
  parameters.ct.path = arguments.ct;
  const RigidTransform start =
      startPose({arguments.initial_pose, arguments.initial_pose_topic, arguments.config}, bag, parameters);
  ToldSession session(&bag, parameters.image, wrong);

  RegistrationPipeline pipeline(parameters, logger);
  loadCt(arguments, wrong, logger, &pipeline);
  const FrameChoice choice = registerFrames(arguments, session, start, &pipeline);
  Engine* engine = pipeline.engine();
  if (engine == nullptr) throw std::runtime_error("device failed: " + pipeline.fault());
  writeAll(arguments, choice, calibrate(choice, &session, engine), &session);
}

}  // namespace xray_registration::tools
