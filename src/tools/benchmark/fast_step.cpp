#include "tools/benchmark/fast_step.h"

#include <stdexcept>

#include "xray_registration/registration/gauss_newton.h"

namespace xray_registration::tools {

FastStep::FastStep(std::shared_ptr<Engine> engine, const FastScene& scene, int span)
    : engine_(std::move(engine)), scene_(scene) {
  window_.span = span;
  const FloatImage target = engine_->render(scene.camera, 0, scene.T_camera_ct_true);
  xray_ = engine_->upload(scene.camera, target, FloatImage(scene.camera.width, scene.camera.height, 1.0F));
}

void FastStep::step() {
  const StepSums sums = engine_->evaluate(xray_.get(), 0, 0, {scene_.T_camera_ct}, window_).front();
  Twist delta;
  if (!dampedStep(sums, 1e-3, &delta)) throw std::runtime_error("benchmark: a step of the fast method was refused");
}

double FastStep::samples(MarchProbe* probe) const {
  probe->plan(*engine_, scene_.camera, scene_.T_camera_ct);
  return probe->samples();
}

}  // namespace xray_registration::tools
