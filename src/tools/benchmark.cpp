// How fast: the paper's tables as published, plain C++ against OpenCL, and the fast method's steps, registrations and
// tracked frames beside them.
#include <cmath>
#include <filesystem>
#include <iostream>

#include "tools/benchmark/paper_tables.h"
#include "tools/benchmark/registration_rows.h"
#include "tools/benchmark/report.h"
#include "tools/benchmark/scenes.h"
#include "tools/benchmark/step_rows.h"
#include "tools/common/command_line.h"
#ifdef XRAY_BENCHMARK_READS_CT
#include "xray_registration/volume/volume_io.h"
#endif
#ifdef XRAY_BENCHMARK_READS_BAGS
#include "tools/benchmark/bag_rows.h"
#endif

namespace xray_registration::tools {
namespace {

struct Arguments {
  std::string json;
  std::string ct;
  std::string bag;
  std::string views;
  std::string device = "auto";
  bool quick = false;
  bool verbose = false;
};

void addOptions(CLI::App* app, Arguments* arguments) {
  app->add_option("--json", arguments->json, "write all rows here");
  app->add_flag("--quick", arguments->quick, "fewer repetitions; leaves out the 512^3 CT");
  app->add_option("--device", arguments->device, "auto, gpu, cpu, or a part of the device's name")
      ->capture_default_str();
  app->add_option("--ct", arguments->ct, "Table II on this CT as well, and the CT of --bag")->check(CLI::ExistingPath);
  app->add_option("--bag", arguments->bag, "time tracked frames of this session; needs --ct")->check(CLI::ExistingFile);
  app->add_option("--views", arguments->views, "views of the session to use, as a,b (default: all)");
  app->add_flag("--verbose", arguments->verbose, "say more on standard error");
}

void check(const Arguments& arguments) {
  if (!arguments.json.empty()) requireWritableParent(arguments.json, "--json");
  if (!arguments.bag.empty() && arguments.ct.empty()) throw ArgumentError("--bag needs --ct");
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

void runTables(const Arguments& arguments, const std::shared_ptr<Device>& device, std::vector<BenchmarkRow>* rows) {
  const int runs = arguments.quick ? 1 : 3;
  printChoices(std::cout);
  const auto one = runTableOne(device, runs);
  printTableOne(std::cout, one);
  append(rows, rowsOfTableOne(one));
  const AttenuationVolume phantom = tableTwoPhantom();
  const auto two = runTableTwo(device, phantom, runs);
  printTableTwo(std::cout, "head phantom", two);
  append(rows, rowsOfTableTwo("registration/table2/paper", two));
  append(rows, measureRegistrations("registration/table2", device, phantom, arguments.quick ? 7 : 50));
}

void runCt(const Arguments& arguments, const std::shared_ptr<Device>& device, const Logger& logger,
           std::vector<BenchmarkRow>* rows) {
  (void)device;
  (void)logger;
  (void)rows;
#ifdef XRAY_BENCHMARK_READS_CT
  if (arguments.ct.empty()) return;
  const AttenuationVolume volume = tableTwoVolume(toAttenuation(readVolume(arguments.ct, {}, logger), {}));
  const auto two = runTableTwo(device, volume, arguments.quick ? 1 : 3);
  const std::string name = std::filesystem::path(arguments.ct).filename().string();
  printTableTwo(std::cout, name, two);
  append(rows, rowsOfTableTwo("registration/table2/" + name + "/paper", two));
  append(rows, measureRegistrations("registration/table2/" + name, device, volume, arguments.quick ? 7 : 50));
#endif
#ifdef XRAY_BENCHMARK_READS_BAGS
  if (arguments.bag.empty()) return;
  append(rows, measureTrackedFrames(arguments.ct, arguments.bag, splitList(arguments.views), arguments.device,
                                    arguments.quick ? 1 : 5, logger));
#endif
  (void)arguments;
}

/// The goals' ratios, from rows that ran in turns.
void printRatios(const std::vector<BenchmarkRow>& rows) {
  const auto find = [&rows](const std::string& name) -> const BenchmarkRow* {
    for (const BenchmarkRow& row : rows) {
      if (row.name == name) return &row;
    }
    return nullptr;
  };
  const BenchmarkRow* cpp = find("step/paper/cpp/128");
  const BenchmarkRow* opencl = find("step/paper/opencl/128");
  const BenchmarkRow* fast = find("step/fast/128");
  const BenchmarkRow* large = find("step/fast/256");
  if (cpp == nullptr || opencl == nullptr || fast == nullptr || large == nullptr) return;
  std::printf(
      "one step at 128: fast is %.0f times faster than the paper's method in plain C++, %.0f times faster than\n"
      "the paper's method on the same device; samples per second at 256 against 128: %.2f\n",
      cpp->milliseconds_median / fast->milliseconds_median, opencl->milliseconds_median / fast->milliseconds_median,
      *large->samples_per_second / *fast->samples_per_second);
}

void benchmark(const Arguments& arguments) {
  check(arguments);
  const Logger logger = standardErrorLogger("benchmark", arguments.verbose);
  const auto device = std::make_shared<Device>(arguments.device, logger);
  std::cout << "device: " << device->name() << "\n\n";
  std::vector<BenchmarkRow> rows;
  append(&rows, measureSteps(device, arguments.quick ? 7 : 50));
  append(&rows, measureDrr(device, arguments.quick ? 7 : 50));
  append(&rows, measureUpload(device, arguments.quick ? 2 : 5));
  if (!arguments.quick) rows.push_back(measureMemory(device));
  runTables(arguments, device, &rows);
  runCt(arguments, device, logger, &rows);
  printRows(std::cout, rows);
  printRatios(rows);
  if (!arguments.json.empty()) writeRowsJson(arguments.json, device->name(), rows);
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
