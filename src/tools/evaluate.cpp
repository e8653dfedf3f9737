// Random starts around a recorded session's true poses: how often, how exactly and how fast the registration finds
// back, and whether its verdict can be trusted.
#include <filesystem>
#include <iostream>
#include <limits>

#include "tools/common/command_line.h"
#include "tools/common/json_files.h"
#include "tools/common/picture.h"
#include "tools/common/progress_bar.h"
#include "tools/common/wrong_option.h"
#include "tools/evaluate/convergence.h"
#include "tools/evaluate/report.h"
#include "tools/evaluate/session_frames.h"
#include "xray_registration/common/stopwatch.h"

namespace xray_registration::tools {
namespace {

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;

struct Arguments {
  std::string ct;
  std::string bag;
  std::string views;
  std::string config;
  std::string device;
  std::string method;
  std::string json;
  std::string plot;
  int trials = 100;
  double rotation_deg = 6.0;
  double translation_mm = 10.0;
  double body_rotation_deg = 0.0;
  double body_translation_mm = 0.0;
  std::uint64_t seed = 1;
  double target_size_mm = 100.0;
  std::vector<std::string> wrong;
  bool tracking = false;
  bool localize = false;
  bool from_nothing = false;
  bool lost = false;
  bool reference = false;
  bool verbose = false;
};

void addOptions(CLI::App* app, Arguments* arguments) {
  app->add_option("--ct", arguments->ct,
                  "CT: NIfTI, NRRD or MetaImage file, or a DICOM folder; not needed when every body has its own")
      ->check(CLI::ExistingPath);
  app->add_option("--bag", arguments->bag, "session with /<view>/image_raw, camera_info and ground_truth")
      ->required()
      ->check(CLI::ExistingFile);
  app->add_option("--views", arguments->views, "views to use, as a,b; the first is the reference (default: all)");
  app->add_option("--config", arguments->config, "the node's parameters as YAML")->check(CLI::ExistingFile);
  app->add_option("--device", arguments->device, "auto, gpu, cpu, or a part of the device's name");
  app->add_option("--method", arguments->method, "fast or paper")->check(CLI::IsMember({"fast", "paper"}));
  app->add_option("--trials", arguments->trials, "number of starts")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app->add_option("--rotation", arguments->rotation_deg, "largest angle of a start from the truth, degrees")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str();
  app->add_option("--translation", arguments->translation_mm, "largest component of a start's shift, mm")
      ->check(CLI::Range(0.0, 10000.0))
      ->capture_default_str();
  app->add_option("--body-rotation", arguments->body_rotation_deg,
                  "the same of each body against the CT's start, degrees")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str();
  app->add_option("--body-translation", arguments->body_translation_mm,
                  "the same of each body against the CT's start, mm")
      ->check(CLI::Range(0.0, 10000.0))
      ->capture_default_str();
  app->add_option("--seed", arguments->seed, "the same seed gives the same starts")->capture_default_str();
  app->add_option("--target-size", arguments->target_size_mm, "side of the cube of targets, mm")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
  app->add_flag(
      "--tracking", arguments->tracking,
      "follow the session from its first true pose instead of random starts; no error is hidden by a restart");
  CLI::Option* const localize = app->add_flag(
      "--localize", arguments->localize,
      "each trial is a wide search (as ~localize) around its start, with --rotation and --translation as its range");
  CLI::Option* const from_nothing =
      app->add_flag("--from-nothing", arguments->from_nothing, "each trial is a wide search without any start");
  from_nothing->excludes(localize);
  app->add_flag(
         "--lost", arguments->lost,
         "each trial loses the CT on purpose: it was tracked off by exactly --rotation and --translation, then 20 "
         "black frames come, then the session's; how soon is it found again?")
      ->excludes(localize)
      ->excludes(from_nothing);
  app->add_flag("--reference", arguments->reference,
                "the poses in the bag are a reference with an error of its own; say how far the solution that starts "
                "there ends from it");
  addWrongOption(app, &arguments->wrong);
  app->add_option("--json", arguments->json, "write all trials and the summary here");
  app->add_option("--plot", arguments->plot,
                  "draw errors, success, convergence and the verdict here (PNG); without --json what it shows is "
                  "written beside it, as .json");
  app->add_flag("--verbose", arguments->verbose, "say more on standard error");
}

NodeParameters parametersOf(const Arguments& arguments, const Logger& logger) {
  try {
    NodeParameters parameters;
    if (!arguments.config.empty()) parameters = loadParametersYaml(arguments.config, logger);
    if (!arguments.views.empty()) parameters.views = splitList(arguments.views);
    if (!arguments.device.empty()) parameters.device = arguments.device;
    if (arguments.method == "fast") parameters.registrar.method = Method::kFast;
    if (arguments.method == "paper") parameters.registrar.method = Method::kPaper;
    validate(parameters);
    return parameters;
  } catch (const ParameterError& error) {
    throw ArgumentError(error.what());
  }
}

/// The session with the views that were asked for, else those of the configuration, else all.
std::unique_ptr<BagSession> openSession(const Arguments& arguments, NodeParameters* parameters, const Logger& logger) {
  BagSessionOptions options;
  options.views = parameters->views;
  options.tolerance_s = parameters->sync.tolerance_s;
  auto session = std::make_unique<BagSession>(arguments.bag, options, logger);
  parameters->views.clear();
  for (const BagView& view : session->views()) parameters->views.push_back(view.name);
  return session;
}

EvaluationRun describe(const Arguments& arguments, const NodeParameters& parameters) {
  EvaluationRun run;
  run.session = std::filesystem::path(arguments.bag).stem().string();
  run.views = parameters.views;
  run.method = parameters.registrar.method == Method::kPaper ? "paper" : "fast";
  run.tracking = arguments.tracking;
  run.reference = arguments.reference;
  if (arguments.localize) run.options.kind = TrialKind::kLocalize;
  if (arguments.from_nothing) run.options.kind = TrialKind::kFromNothing;
  if (arguments.lost) run.options.kind = TrialKind::kLost;
  run.options.trials = arguments.trials;
  run.options.range = {arguments.rotation_deg * kRadPerDeg, arguments.translation_mm};
  run.options.body_range = {arguments.body_rotation_deg * kRadPerDeg, arguments.body_translation_mm};
  run.options.seed = arguments.seed;
  run.options.target_size_mm = arguments.target_size_mm;
  run.wrong = wrongInputs(arguments.wrong);
  return run;
}

double loadCt(RegistrationPipeline* pipeline, const Arguments& arguments, const NodeParameters& parameters,
              const std::vector<WrongInput>& wrong, const Logger& logger) {
  pipeline->openDevice();
  if (!parameters.needsCt() && arguments.ct.empty()) {
    const Stopwatch watch;
    pipeline->loadBodies();
    return watch.milliseconds();
  }
  Volume ct = readVolume(arguments.ct, parameters.ct.read, logger);
  tellWrong(wrong, &ct);
  const Stopwatch watch;
  pipeline->setCt(std::move(ct));
  return watch.milliseconds();
}

std::vector<EvaluationFrame> loadFrames(const BagSession& session, const EvaluationRun& run,
                                        const NodeParameters& parameters, const Logger& logger) {
  const std::size_t limit =
      run.tracking ? std::numeric_limits<std::size_t>::max() : static_cast<std::size_t>(run.options.trials);
  std::vector<EvaluationFrame> frames = sessionFrames(session, parameters, limit, logger);
  for (EvaluationFrame& frame : frames) tellWrongViews(run.wrong, &frame.views);
  return frames;
}

std::vector<Trial> runAll(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames,
                          const Eigen::Vector3d& centre_ct_mm, const EvaluationRun& run) {
  const std::size_t total = run.tracking ? frames.size() : static_cast<std::size_t>(run.options.trials);
  ProgressBar bar(run.session, total);
  const Progress progress = [&bar](int done, int) { bar.advanceTo(static_cast<std::size_t>(done)); };
  if (!run.tracking) return runTrials(pipeline, frames, centre_ct_mm, run.options, progress);
  return followFrames(pipeline, frames, centre_ct_mm, run.options.target_size_mm, progress);
}

/// Where the report goes: a picture is drawn from it, so it is then written in any case.
std::string reportPath(const Arguments& arguments) {
  if (!arguments.json.empty() || arguments.plot.empty()) return arguments.json;
  return std::filesystem::path(arguments.plot).replace_extension(".json");
}

void evaluate(const Arguments& arguments) {
  const Logger logger = standardErrorLogger("evaluate", arguments.verbose);
  if (!arguments.json.empty()) requireWritableParent(arguments.json, "--json");
  if (!arguments.plot.empty()) requireWritableParent(arguments.plot, "--plot");
  NodeParameters parameters = parametersOf(arguments, logger);
  if (arguments.ct.empty() && parameters.needsCt()) {
    throw ArgumentError("--ct is required, unless every body of the configuration has its own ct or mesh");
  }
  const auto session = openSession(arguments, &parameters, logger);
  EvaluationRun run = describe(arguments, parameters);

  RegistrationPipeline pipeline(parameters, logger);
  run.ct_upload_ms = loadCt(&pipeline, arguments, parameters, run.wrong, logger);
  run.device = pipeline.deviceName();
  run.ct = pipeline.ctName();
  const Eigen::Vector3d centre_ct_mm = pipeline.ct() ? pipeline.ct()->grid.centreCt() : pipeline.centreCt();
  pipeline.dropCt();

  const std::vector<EvaluationFrame> frames = loadFrames(*session, run, parameters, logger);
  run.frames = static_cast<int>(frames.size());

  const std::vector<Trial> trials = runAll(&pipeline, frames, centre_ct_mm, run);
  if (run.reference) {
    run.reference_agreement =
        runTrial(&pipeline, frames.front(), Twist::Zero(), centre_ct_mm, run.options.target_size_mm).final;
  }
  const SuccessCriteria criteria = successCriteria(static_cast<int>(run.views.size()));
  printTable(std::cout, run, trials, criteria);
  std::vector<ConvergenceCurve> convergence;
  if (!arguments.plot.empty() && !run.tracking && run.options.kind == TrialKind::kFromStart) {
    convergence = convergenceOf(&pipeline, frames, trials, centre_ct_mm, run.options.target_size_mm);
  }
  const std::string report = reportPath(arguments);
  if (!report.empty()) writeJson(report, toJson(run, trials, criteria, convergence));
  if (!arguments.plot.empty()) drawPicture("evaluation", arguments.plot, report);
}

}  // namespace
}  // namespace xray_registration::tools

int main(int argc, char** argv) {
  using namespace xray_registration::tools;
  Arguments arguments;
  CLI::App app("Registers from random starts around a session's true poses and reports errors, success and verdict.",
               "evaluate");
  addOptions(&app, &arguments);
  return runTool(app, argc, argv, [&arguments] { evaluate(arguments); });
}
