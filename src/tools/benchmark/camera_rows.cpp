#include "tools/benchmark/camera_rows.h"

#include "tools/benchmark/fast_step.h"

namespace xray_registration::tools {
namespace {

/// 2° and 2 mm along every axis, about the CT's centre.
RigidTransform nearby(const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm) {
  const Eigen::Vector3d shift_mm = Eigen::Vector3d::Constant(2.0);
  const Eigen::AngleAxisd turn(2.0 * EIGEN_PI / 180.0, Eigen::Vector3d::Ones().normalized());
  return T_camera_ct * Eigen::Translation3d(centre_ct_mm + shift_mm) * turn * Eigen::Translation3d(-centre_ct_mm);
}

void addCases(FastStep* step, MarchProbe* probe, std::vector<BenchmarkCase>* cases) {
  const FastScene& scene = step->scene();
  const std::string name = "/camera/" + std::to_string(scene.camera.width);
  const double samples = step->samples(probe);
  Engine* engine = &step->engine();
  cases->push_back({"drr" + name, [engine, scene] { engine->render(scene.camera, 0, scene.T_camera_ct); }, samples,
                    "image read back"});
  cases->push_back({"drr_gradient" + name, [step] { step->step(); }, samples, "gradient and Gauss-Newton matrix"});
  cases->push_back({"drr_derivatives" + name,
                    [engine, scene] { engine->renderWithDerivatives(scene.camera, 0, scene.T_camera_ct); }, samples,
                    "seven images read back"});
}

}  // namespace

std::vector<BenchmarkRow> measureCameras(const std::shared_ptr<Device>& device, const AttenuationVolume& volume,
                                         const std::vector<XrayCamera>& cameras, const RigidTransform& T_camera_ct,
                                         int rounds) {
  const std::shared_ptr<Engine> engine = makeEngineOpenCl(device);
  engine->setVolume(volume);
  MarchProbe probe(device);
  std::vector<std::unique_ptr<FastStep>> steps;
  std::vector<BenchmarkCase> cases;
  for (const XrayCamera& camera : cameras) {
    const FastScene scene = {camera, T_camera_ct, nearby(T_camera_ct, anatomicalCentreCt(volume))};
    steps.push_back(std::make_unique<FastStep>(engine, scene));
    addCases(steps.back().get(), &probe, &cases);
  }
  return measureInTurns("cameras", cases, rounds);
}

}  // namespace xray_registration::tools
