#include "tools/benchmark/profile.h"

#include <memory>

#include "tools/benchmark/fast_step.h"
#include "tools/benchmark/measure.h"
#include "tools/common/progress_bar.h"
#include "xray_registration/common/statistics.h"

namespace xray_registration::tools {
namespace {

struct Times {
  std::vector<double> step, plan, march, windows, drr, loads;
};

struct Subject {
  int n;
  char axis;
  std::unique_ptr<FastStep> step;
  Times times;
};

// Until both processors' caches hold what another subject's turn has driven out.
constexpr int kWarmRuns = 5;

/// All parts of one subject once, each after untimed runs.
void measureOnce(Subject* subject, MarchProbe* probe) {
  Engine& engine = subject->step->engine();
  const FastScene& scene = subject->step->scene();
  Times& times = subject->times;
  for (int run = 0; run < kWarmRuns; ++run) subject->step->step();
  times.step.push_back(millisecondsOf([&] { subject->step->step(); }));
  const Engine::KernelTimes step = engine.lastKernelTimes();
  times.plan.push_back(step.plan_ms);
  times.march.push_back(step.march_ms);
  times.windows.push_back(step.windows_ms);
  for (int run = 0; run <= kWarmRuns; ++run) engine.render(scene.camera, 0, scene.T_camera_ct);
  times.drr.push_back(engine.lastKernelTimes().march_ms);
  subject->step->samples(probe);
  for (int run = 0; run < kWarmRuns; ++run) probe->loadsOnlyMs();
  times.loads.push_back(probe->loadsOnlyMs());
}

StepProfile profileOf(const Subject& subject, MarchProbe* probe) {
  StepProfile profile;
  profile.n = subject.n;
  profile.axis = subject.axis;
  profile.step_ms = median(subject.times.step);
  profile.plan_ms = median(subject.times.plan);
  profile.march_ms = median(subject.times.march);
  profile.windows_ms = median(subject.times.windows);
  profile.drr_march_ms = median(subject.times.drr);
  profile.loads_only_ms = median(subject.times.loads);
  profile.samples = subject.step->samples(probe);
  profile.loaded_bytes = probe->loadedBytes();
  profile.volume_bytes = static_cast<double>(subject.step->engine().volume().levels().front().bytes);
  return profile;
}

}  // namespace

Ceiling measureCeiling(const std::shared_ptr<Device>& device, int rounds, bool quick) {
  MarchProbe probe(device);
  std::vector<Subject> subjects;
  for (const int n : {128, 256}) {
    const AttenuationVolume volume = headScene(n);
    const std::shared_ptr<Engine> engine = makeEngineOpenCl(device);
    engine->setVolume(volume);
    for (const char axis : {'z', 'x'}) {
      subjects.push_back({n, axis, std::make_unique<FastStep>(engine, fastScene(volume.grid, n, axis)), {}});
    }
  }
  ProgressBar bar("ceiling", static_cast<std::size_t>(rounds) + 1);
  for (int round = 0; round <= rounds; ++round) {
    for (Subject& subject : subjects) {
      measureOnce(&subject, &probe);
      if (round == 0) subject.times = {};  // Warms up.
    }
    bar.advanceTo(static_cast<std::size_t>(round) + 1);
  }
  Ceiling ceiling;
  for (const Subject& subject : subjects) ceiling.profiles.push_back(profileOf(subject, &probe));
  ceiling.copy_bytes_per_second = probe.copyBytesPerSecond(static_cast<std::size_t>(quick ? 64 : 256) << 20U);
  return ceiling;
}

}  // namespace xray_registration::tools
