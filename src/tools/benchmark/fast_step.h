#pragma once

#include <memory>

#include "tools/benchmark/march_probe.h"
#include "tools/benchmark/scenes.h"
#include "xray_registration/drr/engine.h"

namespace xray_registration::tools {

/// One Gauss-Newton step of the fast method, everything in it: plan, march, windows, sums read back, solve. The X-ray
/// is the engine's own DRR at the scene's truth.
class FastStep {
 public:
  /// `engine` has its volume already; several steps may share it.
  FastStep(std::shared_ptr<Engine> engine, const FastScene& scene, int span = 2);

  /// @throws std::runtime_error when the step cannot be solved.
  void step();

  /// March samples of one step (MarchProbe::samples).
  double samples(MarchProbe* probe) const;

  Engine& engine() { return *engine_; }
  const FastScene& scene() const { return scene_; }

 private:
  std::shared_ptr<Engine> engine_;
  FastScene scene_;
  WindowOptions window_;
  std::unique_ptr<ResidentXray> xray_;
};

}  // namespace xray_registration::tools
