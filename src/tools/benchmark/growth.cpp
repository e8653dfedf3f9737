#include "tools/benchmark/growth.h"

#include <map>

#include "tools/benchmark/fast_step.h"
#include "xray_registration/registration/fast_registrar.h"

namespace xray_registration::tools {
namespace {

constexpr int kFixedSize = 256;  ///< Of whatever does not grow.

AttenuationVolume volumeOf(int n) { return n <= 256 ? headScene(n) : doubled(headScene(n / 2)); }

std::shared_ptr<Engine> engineOf(const std::shared_ptr<Device>& device, const AttenuationVolume& volume) {
  std::shared_ptr<Engine> engine = makeEngineOpenCl(device);
  engine->setVolume(volume);
  return engine;
}

/// A step and a DRR of one scene.
void addCases(const std::string& prefix, FastStep* step, MarchProbe* probe, std::vector<BenchmarkCase>* cases) {
  const double samples = step->samples(probe);
  cases->push_back({prefix + "/step", [step] { step->step(); }, samples, {}});
  const auto render = [step] { step->engine().render(step->scene().camera, 0, step->scene().T_camera_ct); };
  cases->push_back({prefix + "/drr", render, samples, {}});
}

std::vector<BenchmarkRow> growCt(const std::shared_ptr<Device>& device, MarchProbe* probe, int rounds, bool quick) {
  std::vector<std::unique_ptr<FastStep>> steps;
  std::vector<BenchmarkCase> cases;
  for (int n = 64; n <= (quick ? 256 : 512); n *= 2) {
    const AttenuationVolume volume = volumeOf(n);
    steps.push_back(std::make_unique<FastStep>(engineOf(device, volume), fastScene(volume.grid, kFixedSize)));
    addCases("growth/ct/" + std::to_string(n), steps.back().get(), probe, &cases);
  }
  return measureInTurns("CT size", cases, rounds);
}

std::vector<BenchmarkRow> growImage(const std::shared_ptr<Engine>& engine, const VolumeGrid& grid, MarchProbe* probe,
                                    int rounds, bool quick) {
  std::vector<std::unique_ptr<FastStep>> steps;
  std::vector<BenchmarkCase> cases;
  for (int n = 64; n <= (quick ? 256 : 1024); n *= 2) {
    steps.push_back(std::make_unique<FastStep>(engine, fastScene(grid, n)));
    addCases("growth/image/" + std::to_string(n), steps.back().get(), probe, &cases);
  }
  return measureInTurns("image size", cases, rounds);
}

/// The scene as a view sees it that stands `angle` around the CT; T_view_first goes with it.
FastScene turnedScene(const FastScene& first, const Eigen::Vector3d& centre_ct_mm, double angle,
                      RigidTransform* T_view_first) {
  const Eigen::Translation3d centre(first.T_camera_ct * centre_ct_mm);
  *T_view_first = RigidTransform(centre * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) * centre.inverse());
  FastScene scene = first;
  scene.T_camera_ct = *T_view_first * first.T_camera_ct;
  scene.T_camera_ct_true = *T_view_first * first.T_camera_ct_true;
  return scene;
}

/// What a tracked frame of one registrar needs.
struct Frame {
  std::shared_ptr<FastRegistrar> registrar;
  std::vector<ViewInput> views;
  RigidTransform T_camera_ct_start = RigidTransform::Identity();

  void run() { registrar->registerFrame(views, T_camera_ct_start, true); }
  /// The cold start that a session begins with: tracked frames build on what it found.
  void begin() { registrar->registerFrame(views, T_camera_ct_start, false); }
};

/// Half way between the scene's start and its truth: how far a patient moves between two frames.
RigidTransform nearTruth(const FastScene& scene, const Eigen::Vector3d& centre_ct_mm) {
  const Eigen::Quaterniond a(scene.T_camera_ct.linear());
  const Eigen::Quaterniond b(scene.T_camera_ct_true.linear());
  RigidTransform near = RigidTransform::Identity();
  near.linear() = a.slerp(0.5, b).toRotationMatrix();
  const Eigen::Vector3d centre = 0.5 * (scene.T_camera_ct * centre_ct_mm + scene.T_camera_ct_true * centre_ct_mm);
  near.translation() = centre - near.linear() * centre_ct_mm;
  return near;
}

ViewInput viewOf(Engine* engine, const FastScene& scene, const RigidTransform& T_view_first) {
  auto xray = std::make_shared<XrayFrame>();
  xray->camera = scene.camera;
  xray->attenuation = engine->render(scene.camera, 0, scene.T_camera_ct_true);
  return ViewInput(xray, T_view_first);
}

std::vector<BenchmarkRow> growViews(const std::shared_ptr<Device>& device, const std::shared_ptr<Engine>& engine,
                                    const AttenuationVolume& volume, MarchProbe* probe, int rounds) {
  constexpr int kViews = 4;
  const Eigen::Vector3d centre = volume.grid.centreCt();
  const FastScene first = fastScene(volume.grid, kFixedSize);
  auto registrar = std::make_shared<FastRegistrar>(device, RegistrarOptions{}, Logger{});
  registrar->setVolume(volume);
  std::vector<std::unique_ptr<FastStep>> steps;
  std::vector<std::unique_ptr<Frame>> frames;
  std::vector<BenchmarkCase> cases;
  std::vector<ViewInput> views;
  double samples = 0.0;
  for (int count = 1; count <= kViews; ++count) {
    RigidTransform T_view_first = RigidTransform::Identity();
    const FastScene scene = turnedScene(first, centre, (count - 1) * EIGEN_PI / kViews, &T_view_first);
    steps.push_back(std::make_unique<FastStep>(engine, scene));
    samples += steps.back()->samples(probe);
    views.push_back(viewOf(engine.get(), scene, T_view_first));
    const auto stepAll = [&steps, count] {
      for (int i = 0; i < count; ++i) steps[static_cast<std::size_t>(i)]->step();
    };
    const std::string prefix = "growth/views/" + std::to_string(count);
    cases.push_back({prefix + "/step", stepAll, samples, {}});
    frames.push_back(std::make_unique<Frame>(Frame{registrar, views, nearTruth(first, centre)}));
    cases.push_back({prefix + "/frame", [frame = frames.back().get()] { frame->run(); }, 0.0, {}});
  }
  frames.back()->begin();
  return measureInTurns("views", cases, rounds);
}

}  // namespace

std::vector<BenchmarkRow> measureGrowth(const std::shared_ptr<Device>& device, int rounds, bool quick) {
  MarchProbe probe(device);
  std::vector<BenchmarkRow> rows = growCt(device, &probe, rounds, quick);
  const AttenuationVolume volume = volumeOf(kFixedSize);
  const auto engine = engineOf(device, volume);
  for (const auto& part :
       {growImage(engine, volume.grid, &probe, rounds, quick), growViews(device, engine, volume, &probe, rounds)}) {
    rows.insert(rows.end(), part.begin(), part.end());
  }
  return rows;
}

namespace {

/// A frame of its own registrar, at its session's begin.
std::unique_ptr<Frame> frameOf(const std::shared_ptr<FastRegistrar>& registrar, std::vector<ViewInput> views,
                               const RigidTransform& T_camera_ct_start) {
  auto frame = std::make_unique<Frame>(Frame{registrar, std::move(views), T_camera_ct_start});
  frame->begin();
  return frame;
}

std::shared_ptr<FastRegistrar> registrarOf(const std::shared_ptr<Device>& device, const AttenuationVolume& volume) {
  auto registrar = std::make_shared<FastRegistrar>(device, RegistrarOptions{}, Logger{});
  registrar->setVolume(volume);
  return registrar;
}

/// As C-arms send them: images of 1024² of a CT of 512×512×140 voxels from the patient's front and side.
std::vector<std::unique_ptr<Frame>> clinicalFrames(const std::shared_ptr<Device>& device) {
  constexpr int kImage = 1024;
  const AttenuationVolume volume = cutTo(volumeOf(512), {512, 512, 140});
  const Eigen::Vector3d centre = volume.grid.centreCt();
  const FastScene front = fastScene(volume.grid, kImage, 'y');
  std::vector<std::unique_ptr<Frame>> frames;
  std::vector<ViewInput> views;
  for (const double angle : {0.0, 0.5 * static_cast<double>(EIGEN_PI)}) {
    const std::shared_ptr<FastRegistrar> registrar = registrarOf(device, volume);
    RigidTransform T_view_first = RigidTransform::Identity();
    const FastScene scene = turnedScene(front, centre, angle, &T_view_first);
    views.push_back(viewOf(&registrar->engine(), scene, T_view_first));
    frames.push_back(frameOf(registrar, views, nearTruth(front, centre)));
  }
  return frames;
}

}  // namespace

std::vector<BenchmarkRow> measureFrames(const std::shared_ptr<Device>& device, int rounds, bool quick) {
  std::vector<std::unique_ptr<Frame>> frames;
  std::vector<BenchmarkCase> cases;
  const auto add = [&](const std::string& name, std::unique_ptr<Frame> frame) {
    frames.push_back(std::move(frame));
    cases.push_back({name, [frame = frames.back().get()] { frame->run(); }, 0.0, "attenuation in memory to verdict"});
  };
  for (const int n : {256, 512}) {
    if (n > 256 && quick) continue;
    const AttenuationVolume volume = volumeOf(n);
    const FastScene scene = fastScene(volume.grid, n);
    const std::shared_ptr<FastRegistrar> registrar = registrarOf(device, volume);
    add("frame/fast/" + std::to_string(n),
        frameOf(registrar, {viewOf(&registrar->engine(), scene, RigidTransform::Identity())},
                nearTruth(scene, volume.grid.centreCt())));
  }
  if (!quick) {
    std::vector<std::unique_ptr<Frame>> clinical = clinicalFrames(device);
    add("frame/clinical/1024", std::move(clinical[0]));
    add("frame/clinical/1024/two_views", std::move(clinical[1]));
  }
  return measureInTurns("frames", cases, rounds);
}

}  // namespace xray_registration::tools
