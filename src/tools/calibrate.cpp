// Finds out about the X-ray device what its images are registered with.
#include "tools/calibrate/grid_mode.h"
#include "tools/common/command_line.h"

namespace {

using namespace xray_registration::tools;

struct Arguments {
  GridArguments grid;
  std::string output;
  std::string json;
};

void run(Arguments* arguments) {
  if (arguments->grid.image.empty()) throw ArgumentError("--grid is required");
  if (!arguments->json.empty()) requireWritableParent(arguments->json, "--json");
  arguments->grid.output = arguments->output;
  arguments->grid.json = arguments->json;
  calibrateFromGrid(arguments->grid);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Calibrates an X-ray device. --grid: makes an undistortion map (the parameter image/undistortion_map) from a "
      "picture of a regular grid on the detector: beads, a plate with holes, or a wire mesh, square or hexagonal.",
      "calibrate");
  app.add_option("--grid", arguments.grid.image, "picture of the grid: DICOM, PNG, TIFF or PGM")
      ->check(CLI::ExistingFile);
  app.add_option("--spacing-mm", arguments.grid.spacing_mm,
                 "distance of neighbouring marks, mm: the size of a pixel at the grid is reported too")
      ->check(CLI::PositiveNumber);
  app.add_option("--output", arguments.output, "folder, made if need be: undistortion_map.yaml, grid.png")->required();
  app.add_option("--json", arguments.json, "the numbers, JSON (docs/formats.md)");
  return runTool(app, argc, argv, [&] { run(&arguments); });
}
