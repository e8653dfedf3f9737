// Finds out about the X-ray device what its images are registered with.
#include "tools/calibrate/grid_mode.h"
#include "tools/common/command_line.h"
#ifdef XRAY_CALIBRATE_READS_BAGS
#include "tools/calibrate/session/session_calibration.h"
#include "tools/common/wrong_option.h"
#endif

namespace {

using namespace xray_registration::tools;

struct Arguments {
  GridArguments grid;
#ifdef XRAY_CALIBRATE_READS_BAGS
  SessionArguments session;
#endif
  std::string output;
  std::string json;
};

void addGridOptions(CLI::App* app, GridArguments* grid) {
  app->add_option("--grid", grid->image, "picture of the grid: DICOM, PNG, TIFF or PGM")->check(CLI::ExistingFile);
  app->add_option("--spacing-mm", grid->spacing_mm,
                  "distance of neighbouring marks, mm: the size of a pixel at the grid is reported too")
      ->check(CLI::PositiveNumber)
      ->needs("--grid");
}

#ifdef XRAY_CALIBRATE_READS_BAGS
const char* const kWhatItDoes =
    "Calibrates an X-ray device. --ct and --bag: focal lengths, principal points, radial distortion and the views' "
    "relative poses from a recorded session, with the CT as the calibration body. --grid: an undistortion map (the "
    "parameter image/undistortion_map) from a picture of a regular grid on the detector: beads, a plate with holes, or "
    "a wire mesh, square or hexagonal.";
const char* const kRequired = "--grid, or --ct and --bag, is required";

void addSessionOptions(CLI::App* app, SessionArguments* session) {
  app->add_option("--ct", session->ct, "CT of what is in the X-rays: NIfTI, NRRD, MetaImage or a DICOM folder")
      ->check(CLI::ExistingPath)
      ->excludes("--grid");
  app->add_option("--bag", session->bag, "recorded session, the CT in several poses")
      ->check(CLI::ExistingFile)
      ->excludes("--grid");
  app->add_option("--views", session->views, "a,b; the first one's camera is the frame of the others (default: all)");
  app->add_option("--config", session->config, "the node's parameters, YAML")->check(CLI::ExistingFile);
  app->add_option("--device", session->device, "auto, gpu, cpu, or a part of the device's name");
  auto* file = app->add_option("--initial-pose", session->initial_pose,
                               "start of the first frame in the first view's camera, YAML (docs/formats.md)")
                   ->check(CLI::ExistingFile);
  app->add_option("--initial-pose-topic", session->initial_pose_topic,
                  "start from the first pose of the CT on this topic of the bag")
      ->excludes(file);
  app->add_option("--frames", session->frames, "frames to use at most, those whose poses differ the most")
      ->check(CLI::Range(1, 200))
      ->capture_default_str();
  app->add_flag("--write-bag", session->write_bag, "also write calibrated.bag: the session with what was found");
  addWrongOption(app, &session->wrong);
  app->add_flag("--verbose", session->verbose, "say what is done");
}

/// False when no session was named.
bool calibrateSession(Arguments* arguments) {
  SessionArguments& session = arguments->session;
  if (session.ct.empty() && session.bag.empty()) return false;
  if (session.ct.empty()) throw ArgumentError("--ct is required with --bag");
  if (session.bag.empty()) throw ArgumentError("--bag is required with --ct");
  session.output = arguments->output;
  session.json = arguments->json;
  calibrateFromSession(session);
  return true;
}
#else
const char* const kWhatItDoes =
    "Calibrates an X-ray device. --grid: makes an undistortion map (the parameter image/undistortion_map) from a "
    "picture of a regular grid on the detector: beads, a plate with holes, or a wire mesh, square or hexagonal.";
const char* const kRequired = "--grid is required";

bool calibrateSession(Arguments*) { return false; }
#endif

void run(Arguments* arguments) {
  if (calibrateSession(arguments)) return;
  if (arguments->grid.image.empty()) throw ArgumentError(kRequired);
  if (!arguments->json.empty()) requireWritableParent(arguments->json, "--json");
  arguments->grid.output = arguments->output;
  arguments->grid.json = arguments->json;
  calibrateFromGrid(arguments->grid);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(kWhatItDoes, "calibrate");
  addGridOptions(&app, &arguments.grid);
#ifdef XRAY_CALIBRATE_READS_BAGS
  addSessionOptions(&app, &arguments.session);
#endif
  app.add_option("--output", arguments.output, "folder, made if need be, for what was found and a picture of it")
      ->required();
  app.add_option("--json", arguments.json, "the numbers, JSON (docs/formats.md)");
  return runTool(app, argc, argv, [&] { run(&arguments); });
}
