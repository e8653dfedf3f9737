// Variants of the fast method's kernels, one benchmark each, by the kernels' own events. docs/performance.md says how
// to try a new one.
#include <benchmark/benchmark.h>

#include <iostream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include "march_by_hand.h"
#include "tools/benchmark/fast_step.h"

namespace xray_registration::tools {
namespace {

/// Engines by CT size, made when first asked for: one compile and one upload each.
class Engines {
 public:
  explicit Engines(std::shared_ptr<Device> device) : device_(std::move(device)), probe_(device_) {}

  std::shared_ptr<Engine> engine(int n) {
    std::shared_ptr<Engine>& engine = engines_[n];
    if (engine == nullptr) {
      const AttenuationVolume volume = headScene(n);
      grids_[n] = volume.grid;
      engine = makeEngineOpenCl(device_);
      engine->setVolume(volume);
    }
    return engine;
  }
  const VolumeGrid& grid(int n) { return grids_.at(n); }
  MarchProbe* probe() { return &probe_; }

 private:
  std::shared_ptr<Device> device_;
  MarchProbe probe_;
  std::map<int, std::shared_ptr<Engine>> engines_;
  std::map<int, VolumeGrid> grids_;
};

enum class Work { kStep, kMarch, kWindows, kDrr, kDerivativeImages, kLoadsOnly, kByHand };

struct Variant {
  std::string name;
  Work work = Work::kMarch;
  int ct = 128;
  int image = 128;
  char axis = 'z';
  int split = 0;  ///< 0: as the engine chooses.
  int span = 2;
};

/// Milliseconds of one run: device time, but for the step, which is the host's.
double runOnce(const Variant& variant, FastStep* step, MarchProbe* probe, MarchByHand* by_hand) {
  Engine& engine = step->engine();
  const FastScene& scene = step->scene();
  switch (variant.work) {
    case Work::kStep:
      step->step();
      return 0.0;
    case Work::kMarch:
      step->step();
      return engine.lastKernelTimes().march_ms;
    case Work::kWindows:
      step->step();
      return engine.lastKernelTimes().windows_ms;
    case Work::kDrr:
      engine.render(scene.camera, 0, scene.T_camera_ct);
      return engine.lastKernelTimes().march_ms;
    case Work::kDerivativeImages:
      engine.renderWithDerivatives(scene.camera, 0, scene.T_camera_ct);
      return engine.lastKernelTimes().march_ms;
    case Work::kLoadsOnly:
      return probe->loadsOnlyMs();
    case Work::kByHand:
      return by_hand->run();
  }
  return 0.0;
}

/// @throws std::runtime_error when it does not see what the device does.
std::unique_ptr<MarchByHand> marchByHand(FastStep* step, const MarchProbe& probe) {
  const FastScene& scene = step->scene();
  auto by_hand = std::make_unique<MarchByHand>(step->engine(), probe, scene.camera, scene.T_camera_ct);
  by_hand->run();
  // Single precision.
  if (!(by_hand->differenceFrom(step->engine().render(scene.camera, 0, scene.T_camera_ct)) < 1e-4)) {
    throw std::runtime_error("the march by hand sees something else than the device");
  }
  return by_hand;
}

void measure(::benchmark::State& state, Engines* engines, const Variant& variant) {
  const auto engine = engines->engine(variant.ct);
  FastStep step(engine, fastScene(engines->grid(variant.ct), variant.image, variant.axis), variant.span);
  const double samples = step.samples(engines->probe());
  engine->forceSplit(variant.split);
  std::unique_ptr<MarchByHand> by_hand;
  if (variant.work == Work::kByHand) by_hand = marchByHand(&step, *engines->probe());
  runOnce(variant, &step, engines->probe(), by_hand.get());  // Compiles and launches once.
  for (auto _ : state) {
    const double ms = runOnce(variant, &step, engines->probe(), by_hand.get());
    if (variant.work != Work::kStep) state.SetIterationTime(ms * 1e-3);
  }
  engine->forceSplit(0);
  if (variant.work != Work::kWindows) {
    state.counters["samples"] = ::benchmark::Counter(samples, ::benchmark::Counter::kIsIterationInvariantRate);
  }
}

std::vector<Variant> variants(bool has_by_hand) {
  std::vector<Variant> all;
  for (const int n : {64, 128, 256}) {
    const std::string size = std::to_string(n);
    all.push_back({"step/" + size, Work::kStep, n, n});
    for (const char axis : {'x', 'y', 'z'}) {
      const std::string where = size + "/" + axis;
      all.push_back({"march/" + where, Work::kMarch, n, n, axis});
      all.push_back({"drr/" + where, Work::kDrr, n, n, axis});
      all.push_back({"loads_only/" + where, Work::kLoadsOnly, n, n, axis});
      if (has_by_hand) all.push_back({"march_by_hand/" + where, Work::kByHand, n, n, axis});
    }
    all.push_back({"derivative_images/" + size, Work::kDerivativeImages, n, n});
  }
  for (const int split : {1, 2, 4}) {
    for (const int image : {32, 128}) {
      const std::string name = std::to_string(split) + "/" + std::to_string(image);
      all.push_back({"march/split/" + name, Work::kMarch, 128, image, 'z', split});
      all.push_back({"drr/split/" + name, Work::kDrr, 128, image, 'z', split});
    }
  }
  for (const int span : {1, 2, 3, 4, 0}) {
    all.push_back({"windows/256/span/" + std::to_string(span), Work::kWindows, 128, 256, 'z', 0, span});
  }
  return all;
}

void registerAll(Engines* engines, bool has_by_hand) {
  for (const Variant& variant : variants(has_by_hand)) {
    auto* one = ::benchmark::RegisterBenchmark(
        variant.name.c_str(), [engines, variant](::benchmark::State& state) { measure(state, engines, variant); });
    one->Unit(::benchmark::kMillisecond);
    if (variant.work == Work::kStep) {
      one->UseRealTime();
    } else {
      one->UseManualTime();
    }
  }
}

}  // namespace
}  // namespace xray_registration::tools

int main(int argc, char** argv) {
  using namespace xray_registration;
  benchmark::Initialize(&argc, argv);
  std::string choice = "auto";
  // What Google Benchmark has left over.
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.rfind("--device=", 0) != 0) {
      std::cerr << "kernel_benchmark: unknown argument '" << argument
                << "'; --device=auto|gpu|cpu|<part of its name> and Google Benchmark's own are allowed\n";
      return 2;
    }
    choice = argument.substr(9);
  }
  try {
    const auto device = std::make_shared<Device>(choice);
    benchmark::AddCustomContext("device", device->name());
    tools::Engines engines(device);
    tools::registerAll(&engines, !device->isGpu() && tools::MarchByHand::isPossible());
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::cerr << "kernel_benchmark: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
