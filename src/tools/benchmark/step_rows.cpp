#include "tools/benchmark/step_rows.h"

#include <stdexcept>

#include "tools/benchmark/fast_step.h"
#include "tools/benchmark/scenes.h"
#include "tools/common/progress_bar.h"
#include "xray_registration/drr/engine.h"
#include "xray_registration/drr/paper/paper_engine.h"
#include "xray_registration/registration/paper/paper_method.h"

namespace xray_registration::tools {
namespace {

/// The head phantom from the paper's geometry at N³ and N², and where a solver may stand: 2° and 2 mm from the truth.
struct StepScene {
  explicit StepScene(int n) : volume(headScene(n)) {
    const PaperGeometry geometry = benchmarkGeometry(volume.grid, n);
    problem.camera = geometry.camera;
    problem.T_camera_ct_start = geometry.T_camera_ct;
    problem.centre_ct_mm = volume.grid.centreCt();
    problem.samples = 3 * n;
    truth << 2.0, 2.0, 2.0, 2.0, 2.0, 2.0;
  }
  AttenuationVolume volume;
  PaperProblem problem;
  PaperParameters truth;
};

class PaperStepper {
 public:
  PaperStepper(const StepScene& scene, std::unique_ptr<PaperEngine> engine)
      : problem_(scene.problem), engine_(std::move(engine)) {
    engine_->setVolume(scene.volume);
    const FloatImage blank(problem_.camera.width, problem_.camera.height);
    engine_->setTarget(blank, {}, {});
    engine_->render(
        0, paperRays(engine_->grid(), problem_.camera, paperPose(problem_, scene.truth), problem_.samples, false));
    engine_->setTarget(engine_->read(0), {}, {});
    options_.max_iterations = 1;
    options_.stop_norm = 0.0;
  }

  void step() {
    if (solvePaper(engine_.get(), problem_, options_).iterations != 1) {
      throw std::runtime_error("benchmark: a step of the paper's method on " + engine_->name() + " was refused");
    }
  }

  double samples() const {
    return 7.0 * problem_.camera.width * problem_.camera.height * static_cast<double>(problem_.samples);
  }

 private:
  PaperProblem problem_;
  PaperOptions options_;
  std::unique_ptr<PaperEngine> engine_;
};

}  // namespace

std::vector<BenchmarkRow> measureSteps(const std::shared_ptr<Device>& device, int rounds) {
  const StepScene small(128);
  const StepScene large(256);
  PaperStepper cpp(small, makePaperEngineCpp());
  PaperStepper opencl(small, makePaperEngineOpenCl(device));
  const auto engineOf = [&device](const StepScene& scene) {
    std::shared_ptr<Engine> engine = makeEngineOpenCl(device);
    engine->setVolume(scene.volume);
    return engine;
  };
  FastStep fast_small(engineOf(small), fastScene(small.volume.grid, 128));
  FastStep fast_large(engineOf(large), fastScene(large.volume.grid, 256));
  MarchProbe probe(device);
  return measureInTurns(
      "one step",
      {{"step/paper/cpp/128", [&] { cpp.step(); }, cpp.samples(), "7 DRRs of 3 N tri-linear samples, one thread"},
       {"step/paper/opencl/128", [&] { opencl.step(); }, opencl.samples(), "the same on the device"},
       {"step/fast/128", [&] { fast_small.step(); }, fast_small.samples(&probe), "value and derivatives in one march"},
       {"step/fast/256", [&] { fast_large.step(); }, fast_large.samples(&probe), {}}},
      rounds);
}

std::vector<BenchmarkRow> measureDrr(const std::shared_ptr<Device>& device, int rounds) {
  const AttenuationVolume volume = headScene(256);
  const PaperGeometry geometry = benchmarkGeometry(volume.grid, 200);
  const std::unique_ptr<Engine> fast = makeEngineOpenCl(device);
  fast->setVolume(volume);
  const auto paper = makePaperEngineOpenCl(device);
  paper->setVolume(volume);
  paper->setTarget(FloatImage(200, 200), {}, {});
  const PaperRays rays = paperRays(volume.grid, geometry.camera, geometry.T_camera_ct, 3 * 256, true);
  MarchProbe probe(device);
  probe.plan(*fast, geometry.camera, geometry.T_camera_ct);
  std::vector<double> kernel_ms;
  const auto renderFast = [&] {
    fast->render(geometry.camera, 0, geometry.T_camera_ct);
    const Engine::KernelTimes times = fast->lastKernelTimes();
    kernel_ms.push_back(times.plan_ms + times.march_ms);
  };
  const auto renderPaper = [&] {
    paper->render(0, rays);
    paper->read(0);
  };
  std::vector<BenchmarkRow> rows =
      measureInTurns("one DRR",
                     {{"drr/paper/opencl/200", renderPaper, 200.0 * 200.0 * rays.samples, "image read back"},
                      {"drr/fast/200", renderFast, probe.samples(), "image read back"}},
                     rounds);
  rows.push_back(rowOf("drr/fast/200/kernel", {kernel_ms.begin() + 1, kernel_ms.end()}));
  rows.back().samples_per_second = probe.samples() / (rows.back().milliseconds_median * 1e-3);
  rows.back().note = "the kernels alone, by their events";
  return rows;
}

std::vector<BenchmarkRow> measureUpload(const std::shared_ptr<Device>& device, int rounds) {
  const AttenuationVolume volume = headScene(256);
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device);
  return measureInTurns("upload",
                        {{"upload/256",
                          [&] {
                            engine->setVolume(volume);
                            device->finish();
                          },
                          0.0, "pyramid, packing and transfer"}},
                        rounds);
}

BenchmarkRow measureMemory(const std::shared_ptr<Device>& device) {
  ProgressBar bar("memory", 1);
  // Full to its faces: no air that the packing could leave out.
  AttenuationVolume volume;
  volume.grid.size.setConstant(512);
  volume.scale_per_mm = 1e-5F;
  volume.values.assign(volume.grid.voxelCount(), 2000);
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device);
  std::vector<double> times = {millisecondsOf([&] { engine->setVolume(volume); })};
  BenchmarkRow row = rowOf("memory/512", times);
  row.bytes = static_cast<double>(engine->volume().bytes());
  const double ratio = *row.bytes / (2.0 * static_cast<double>(volume.values.size()));
  char note[96];
  std::snprintf(note, sizeof note, "%.0f MiB, %.2f times the CT's 16-bit size; the time is one upload",
                *row.bytes / 1048576.0, ratio);
  row.note = note;
  return row;
}

}  // namespace xray_registration::tools
