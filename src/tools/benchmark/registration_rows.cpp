#include "tools/benchmark/registration_rows.h"

#include <array>
#include <cstdio>

#include "tools/benchmark/scenes.h"
#include "xray_registration/drr/paper/paper_engine.h"
#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/registration/fast_registrar.h"
#include "xray_registration/registration/paper/paper_method.h"

namespace xray_registration::tools {
namespace {

struct Start {
  int size = 0;
  RigidTransform T_camera_ct_true = RigidTransform::Identity();
  XrayFrame xray;
  RegistrationResult result;
};

Start startOf(int size, const AttenuationVolume& volume, const PaperProblem& problem, PaperEngine* painter) {
  PaperParameters truth;
  truth << size, size, size, size, size, size;
  Start start;
  start.size = size;
  start.T_camera_ct_true = paperPose(problem, truth);
  start.xray.camera = problem.camera;
  painter->render(0, paperRays(volume.grid, problem.camera, start.T_camera_ct_true, problem.samples, true));
  start.xray.attenuation = painter->read(0);
  return start;
}

std::string describe(const Start& start, const Eigen::Vector3d& centre_ct_mm) {
  const PoseError error = poseError(start.result.T_camera_ct, start.T_camera_ct_true, targetGrid(centre_ct_mm, 100.0));
  char text[128];
  std::snprintf(text, sizeof text, "%d steps, mTRE %.3f mm, in-plane %.3f mm%s", start.result.iterations, error.mtre_mm,
                error.inplane_mm, start.result.accepted ? "" : ", REFUSED");
  return text;
}

}  // namespace

std::vector<BenchmarkRow> measureRegistrations(const std::string& prefix, const std::shared_ptr<Device>& device,
                                               const AttenuationVolume& volume, int rounds) {
  const PaperGeometry geometry = benchmarkGeometry(volume.grid, 128);
  PaperProblem problem;
  problem.camera = geometry.camera;
  problem.T_camera_ct_start = geometry.T_camera_ct;
  problem.centre_ct_mm = volume.grid.centreCt();
  problem.samples = 3 * volume.grid.size.z();
  const auto painter = makePaperEngineOpenCl(device);
  painter->setVolume(volume);
  painter->setTarget(FloatImage(problem.camera.width, problem.camera.height), {}, {});

  FastRegistrar registrar(device, RegistrarOptions{}, {});
  registrar.setVolume(volume);
  std::array<Start, 3> starts;
  std::vector<BenchmarkCase> cases;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    Start& start = starts[i];
    start = startOf(2 * static_cast<int>(i + 1), volume, problem, painter.get());
    const auto run = [&start, &registrar, &geometry, view = ViewInput(start.xray)] {
      start.result = registrar.registerFrame({view}, geometry.T_camera_ct, false);
    };
    cases.push_back({prefix + "/" + std::to_string(start.size), run, 0.0, {}});
  }
  std::vector<BenchmarkRow> rows = measureInTurns("registrations", cases, rounds);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].note = describe(starts[i], problem.centre_ct_mm);
  return rows;
}

}  // namespace xray_registration::tools
