// How fast: the paper's tables as published, plain C++ against OpenCL, and the fast method's steps, registrations and
// tracked frames beside them.
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "tools/benchmark/camera_rows.h"
#include "tools/benchmark/growth.h"
#include "tools/benchmark/paper/paper_tables.h"
#include "tools/benchmark/registration_rows.h"
#include "tools/benchmark/report.h"
#include "tools/benchmark/scenes.h"
#include "tools/benchmark/step_rows.h"
#include "tools/common/command_line.h"
#include "tools/common/json_files.h"
#ifdef XRAY_BENCHMARK_READS_CT
#include "tools/common/yaml_files.h"
#include "xray_registration/volume/volume_io.h"
#endif
#ifdef XRAY_BENCHMARK_READS_BAGS
#include "tools/benchmark/bag_rows.h"
#endif

namespace xray_registration::tools {
namespace {

const std::vector<std::string> kParts = {"steps",  "drr",    "upload", "memory", "frames", "ceiling",
                                         "tables", "growth", "ct",     "bag",    "camera"};

struct Arguments {
  std::string json;
  std::string ct;
  std::string bag;
  std::string views;
  std::vector<std::string> cameras;
  std::string pose;
  std::string only;
  std::string device = "auto";
  bool quick = false;
  bool growth = false;
  bool verbose = false;

  /// Whether a part is to be run: all by default, but the growth curves only when asked for.
  bool wants(const std::string& part) const {
    if (only.empty()) return part != "growth" || growth;
    const std::vector<std::string> parts = splitList(only);
    return std::find(parts.begin(), parts.end(), part) != parts.end() || (part == "growth" && growth);
  }
  int rounds() const { return quick ? 7 : 50; }
};

void addOptions(CLI::App* app, Arguments* arguments) {
  app->add_option("--json", arguments->json, "write everything here");
  app->add_flag("--quick", arguments->quick, "fewer repetitions; leaves out the 512^3 CT");
  app->add_option("--device", arguments->device, "auto, gpu, cpu, or a part of the device's name")
      ->capture_default_str();
  app->add_option("--ct", arguments->ct, "Table II on this CT as well, and the CT of --bag")->check(CLI::ExistingPath);
  app->add_option("--bag", arguments->bag, "time tracked frames of this session; needs --ct")->check(CLI::ExistingFile);
  app->add_option("--views", arguments->views, "views of the session to use, as a,b (default: all)");
  auto* camera = app->add_option("--camera", arguments->cameras, "a DRR of --ct for each of these cameras, YAML")
                     ->check(CLI::ExistingFile);
  app->add_option("--pose", arguments->pose, "pose of the CT in them, YAML")->check(CLI::ExistingFile)->needs(camera);
  app->add_flag("--growth", arguments->growth,
                "also how times grow with CT size, image size and views (plot_results draws it)");
  app->add_option(
      "--only", arguments->only,
      "parts to run, comma-separated: steps, drr, upload, memory, frames, ceiling, tables (the paper's, and "
      "registrations from Table II's starts), growth, ct (tables on --ct), bag, camera");
  app->add_flag("--verbose", arguments->verbose, "say more on standard error");
}

void check(const Arguments& arguments) {
  if (!arguments.json.empty()) requireWritableParent(arguments.json, "--json");
  for (const std::string& part : splitList(arguments.only)) {
    if (std::find(kParts.begin(), kParts.end(), part) == kParts.end())
      throw ArgumentError("--only: there is no part '" + part + "'");
  }
  if (!arguments.bag.empty() && arguments.ct.empty()) throw ArgumentError("--bag needs --ct");
  if (!arguments.cameras.empty() && (arguments.ct.empty() || arguments.pose.empty())) {
    throw ArgumentError("--camera needs --ct and --pose");
  }
  if (!arguments.views.empty() && arguments.bag.empty()) throw ArgumentError("--views needs --bag");
#ifndef XRAY_BENCHMARK_READS_CT
  if (!arguments.ct.empty()) throw ArgumentError("--ct: this build (XRAY_REGISTRATION_COMPUTE_ONLY) reads no CTs");
#endif
#ifndef XRAY_BENCHMARK_READS_BAGS
  if (!arguments.bag.empty()) throw ArgumentError("--bag: this build (XRAY_REGISTRATION_ROS=OFF) reads no bags");
#endif
}

void append(std::vector<BenchmarkRow>* rows, const std::vector<BenchmarkRow>& more) {
  rows->insert(rows->end(), more.begin(), more.end());
}

/// The paper's Table II on a volume, and the fast method from the same starts.
void runTableTwoOn(const Arguments& arguments, const std::shared_ptr<Device>& device, const AttenuationVolume& volume,
                   const std::string& title, const std::string& suffix, BenchmarkReport* report) {
  const auto two = runTableTwo(device, volume, arguments.quick ? 1 : 3);
  printTableTwo(std::cout, title, two);
  const std::string prefix = "registration/table2" + suffix;
  append(&report->rows, rowsOfTableTwo(prefix + "/paper", two));
  append(&report->rows, measureRegistrations(prefix, device, volume, arguments.rounds()));
  report->tables.push_back({"table2" + suffix, false, two});
}

void runTables(const Arguments& arguments, const std::shared_ptr<Device>& device, BenchmarkReport* report) {
  printChoices(std::cout);
  const auto one = runTableOne(device, arguments.quick ? 1 : 3);
  printTableOne(std::cout, one);
  append(&report->rows, rowsOfTableOne(one));
  report->tables.push_back({"table1", true, one});
  runTableTwoOn(arguments, device, tableTwoPhantom(), "head phantom", "", report);
}

void runPhantoms(const Arguments& arguments, const std::shared_ptr<Device>& device, BenchmarkReport* report) {
  const int rounds = arguments.rounds();
  std::vector<BenchmarkRow>* rows = &report->rows;
  if (arguments.wants("steps")) append(rows, measureSteps(device, rounds));
  if (arguments.wants("drr")) append(rows, measureDrr(device, rounds));
  if (arguments.wants("upload")) append(rows, measureUpload(device, arguments.quick ? 2 : 5));
  if (arguments.wants("memory") && !arguments.quick) rows->push_back(measureMemory(device));
  if (arguments.wants("frames")) append(rows, measureFrames(device, rounds, arguments.quick));
  if (arguments.wants("ceiling")) report->ceiling = measureCeiling(device, rounds, arguments.quick);
  if (arguments.wants("tables")) runTables(arguments, device, report);
  if (arguments.wants("growth")) append(rows, measureGrowth(device, arguments.quick ? 3 : 15, arguments.quick));
}

#ifdef XRAY_BENCHMARK_READS_CT
void runCameras(const Arguments& arguments, const std::shared_ptr<Device>& device, const AttenuationVolume& volume,
                BenchmarkReport* report) {
  std::vector<XrayCamera> cameras;
  for (const std::string& path : arguments.cameras) cameras.push_back(readCameraFile(path));
  append(&report->rows, measureCameras(device, volume, cameras, readPoseFile(arguments.pose),
                                       arguments.quick ? 1 : arguments.rounds()));
}

void runCt(const Arguments& arguments, const std::shared_ptr<Device>& device, const Logger& logger,
           BenchmarkReport* report) {
  if (arguments.ct.empty()) return;
  if (arguments.wants("ct")) {
    const AttenuationVolume volume = tableTwoVolume(toAttenuation(readVolume(arguments.ct, {}, logger), {}));
    const std::string name = std::filesystem::path(arguments.ct).filename().string();
    runTableTwoOn(arguments, device, volume, name, "/" + name, report);
  }
  if (!arguments.cameras.empty() && arguments.wants("camera")) {
    runCameras(arguments, device, toAttenuation(readVolume(arguments.ct, {}, logger), {}), report);
  }
#ifdef XRAY_BENCHMARK_READS_BAGS
  if (arguments.bag.empty() || !arguments.wants("bag")) return;
  append(&report->rows, measureTrackedFrames(arguments.ct, arguments.bag, splitList(arguments.views), arguments.device,
                                             arguments.quick ? 1 : 5, logger));
#endif
}
#endif

void benchmark(const Arguments& arguments) {
  check(arguments);
  const Logger logger = standardErrorLogger("benchmark", arguments.verbose);
  const auto device = std::make_shared<Device>(arguments.device, logger);
  std::cout << "device: " << device->name() << "\n\n";
  BenchmarkReport report;
  report.device = device->name();
  runPhantoms(arguments, device, &report);
#ifdef XRAY_BENCHMARK_READS_CT
  runCt(arguments, device, logger, &report);
#endif
  report.goals = goalsOf(report.rows, device->isGpu());
  printRows(std::cout, report.rows);
  printCeiling(std::cout, report.ceiling);
  printGoals(std::cout, report.goals);
  if (!arguments.json.empty()) writeJson(arguments.json, toJson(report));
}

}  // namespace
}  // namespace xray_registration::tools

int main(int argc, char** argv) {
  using namespace xray_registration::tools;
  Arguments arguments;
  CLI::App app("Times the paper's method as published and the fast method, on phantoms and on a session.", "benchmark");
  addOptions(&app, &arguments);
  return runTool(app, argc, argv, [&arguments] { benchmark(arguments); });
}
