#include "tools/benchmark/paper/paper_tables.h"

#include <algorithm>
#include <cmath>

#include "tools/benchmark/scenes.h"
#include "tools/common/progress_bar.h"
#include "xray_registration/registration/paper/paper_method.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration::tools {
namespace {

struct Experiment {
  PaperProblem problem;
  PaperOptions options;
  PaperParameters truth;
};

Experiment experimentOn(const VolumeGrid& grid, int image_size, double angle_deg, double shift, double unit_mm) {
  Experiment experiment;
  const PaperGeometry geometry = benchmarkGeometry(grid, image_size);
  experiment.problem.camera = geometry.camera;
  experiment.problem.T_camera_ct_start = geometry.T_camera_ct;
  experiment.problem.centre_ct_mm = grid.centreCt();
  experiment.problem.unit_mm = unit_mm;
  experiment.problem.samples = 3 * grid.size.z();
  experiment.options.time_parts = true;
  experiment.options.rotation_step_deg = 0.5;
  experiment.options.translation_step = 0.5 / unit_mm;
  experiment.truth << angle_deg, angle_deg, angle_deg, shift, shift, shift;
  return experiment;
}

/// The portal image of the paper: the engine's own DRR at the truth.
void synthesiseTarget(PaperEngine* engine, const Experiment& experiment) {
  const PaperProblem& problem = experiment.problem;
  engine->setTarget(FloatImage(problem.camera.width, problem.camera.height), {}, {});
  engine->render(0, paperRays(engine->grid(), problem.camera, paperPose(problem, experiment.truth), problem.samples,
                              problem.line_integrals));
  engine->setTarget(engine->read(0), {}, {});
}

PaperRun runOnce(PaperEngine* engine, const Experiment& experiment) {
  PaperSolution solution;
  PaperRun run;
  run.total_ms = millisecondsOf([&] { solution = solvePaper(engine, experiment.problem, experiment.options); });
  run.drr_ms = solution.drr_ms;
  run.other_ms = run.total_ms - run.drr_ms;
  run.iterations = solution.iterations;
  run.converged = solution.converged;
  const PaperParameters error = solution.s - experiment.truth;
  run.angle_error_deg = error.head<3>().norm() / std::sqrt(3.0);
  run.shift_error_mm = error.tail<3>().norm() / std::sqrt(3.0) * experiment.problem.unit_mm;
  run.relative_error = error.norm() / experiment.truth.norm();
  return run;
}

/// The run with the median total time.
PaperRun medianRun(std::vector<PaperRun> runs) {
  std::sort(runs.begin(), runs.end(), [](const PaperRun& a, const PaperRun& b) { return a.total_ms < b.total_ms; });
  PaperRun median = runs[(runs.size() - 1) / 2];
  for (const PaperRun& run : runs) median.all_totals_ms.push_back(run.total_ms);
  return median;
}

/// Both implementations in turns, after one unmeasured registration on the device (its kernels are compiled then).
void runBoth(PaperEngine* cpp, PaperEngine* opencl, const Experiment& experiment, int runs, PaperTableRow* row) {
  synthesiseTarget(cpp, experiment);
  synthesiseTarget(opencl, experiment);
  runOnce(opencl, experiment);
  std::vector<PaperRun> cpp_runs;
  std::vector<PaperRun> opencl_runs;
  for (int i = 0; i < runs; ++i) {
    cpp_runs.push_back(runOnce(cpp, experiment));
    opencl_runs.push_back(runOnce(opencl, experiment));
  }
  row->cpp = medianRun(cpp_runs);
  row->opencl = medianRun(opencl_runs);
}

}  // namespace

std::vector<PaperTableRow> runTableOne(const std::shared_ptr<Device>& device, int runs) {
  struct Published {
    int n;
    PublishedTimes cpp;
    PublishedTimes gpu;
  };
  const std::vector<Published> published = {{16, {0.012, 0.003, 0.015, 6}, {0.029, 0.109, 0.138, 6}},
                                            {32, {0.140, 0.060, 0.200, 5}, {0.047, 0.139, 0.186, 5}},
                                            {64, {3.990, 1.318, 5.308, 5}, {0.091, 0.171, 0.262, 5}},
                                            {128, {40.331, -1.0, 56.72, -1}, {0.152, -1.0, 0.400, -1}}};
  const auto cpp = makePaperEngineCpp();
  const auto opencl = makePaperEngineOpenCl(device);
  std::vector<PaperTableRow> rows;
  ProgressBar bar("Table I", published.size());
  for (const Published& one : published) {
    constexpr double kSideMm = 100.0;
    const AttenuationVolume cube = toAttenuation(whiteCube(one.n, kSideMm), {});
    cpp->setVolume(cube);
    opencl->setVolume(cube);
    Experiment experiment = experimentOn(cube.grid, one.n, 5.0, 0.1, kSideMm);
    experiment.options.stop_norm = 0.1;
    // The aligned cube's derivative by its angles nearly vanishes; smaller steps send the coarse cube a quarter turn
    // off.
    experiment.options.rotation_step_deg = 2.0;
    experiment.options.translation_step = 0.05;
    PaperTableRow row;
    row.label = std::to_string(one.n);
    row.published_cpp = one.cpp;
    row.published_gpu = one.gpu;
    runBoth(cpp.get(), opencl.get(), experiment, runs, &row);
    rows.push_back(row);
    bar.advanceTo(rows.size());
  }
  return rows;
}

std::vector<PaperTableRow> runTableTwo(const std::shared_ptr<Device>& device, const AttenuationVolume& volume,
                                       int runs) {
  struct Published {
    int size;
    PublishedTimes cpp;
    PublishedTimes gpu;
  };
  const std::vector<Published> published = {{2, {123.27, 44.89, 168.16, 5}, {0.62, 1.13, 1.75, 5}},
                                            {4, {191.94, 71.36, 263.30, 8}, {0.98, 1.72, 2.70, 8}},
                                            {6, {267.96, 103.43, 371.39, 11}, {1.32, 2.33, 3.65, 11}}};
  const auto cpp = makePaperEngineCpp();
  const auto opencl = makePaperEngineOpenCl(device);
  cpp->setVolume(volume);
  opencl->setVolume(volume);
  std::vector<PaperTableRow> rows;
  ProgressBar bar("Table II", published.size());
  for (const Published& one : published) {
    Experiment experiment = experimentOn(volume.grid, 128, one.size, one.size, 1.0);
    experiment.options.stop_norm = 0.8;
    PaperTableRow row;
    row.label = std::to_string(one.size);
    row.published_cpp = one.cpp;
    row.published_gpu = one.gpu;
    runBoth(cpp.get(), opencl.get(), experiment, runs, &row);
    rows.push_back(row);
    bar.advanceTo(rows.size());
  }
  return rows;
}

namespace {

BenchmarkRow rowOfRun(const std::string& name, const PaperRun& run) {
  BenchmarkRow row = rowOf(name, run.all_totals_ms);
  row.note = std::to_string(run.iterations) + " iterations" + (run.converged ? "" : ", not converged");
  return row;
}

std::vector<BenchmarkRow> rowsOfTable(const std::string& prefix, const std::vector<PaperTableRow>& table) {
  std::vector<BenchmarkRow> rows;
  for (const PaperTableRow& row : table) {
    rows.push_back(rowOfRun(prefix + "/cpp/" + row.label, row.cpp));
    rows.push_back(rowOfRun(prefix + "/opencl/" + row.label, row.opencl));
  }
  return rows;
}

}  // namespace

std::vector<BenchmarkRow> rowsOfTableTwo(const std::string& prefix, const std::vector<PaperTableRow>& rows) {
  return rowsOfTable(prefix, rows);
}

std::vector<BenchmarkRow> rowsOfTableOne(const std::vector<PaperTableRow>& rows) {
  return rowsOfTable("registration/table1/paper", rows);
}

}  // namespace xray_registration::tools
