#include "xray_registration/drr/paper/paper_engine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

struct Scene {
  AttenuationVolume volume;
  XrayCamera camera;
  RigidTransform T_camera_ct = RigidTransform::Identity();
};

/// A head of 6 mm voxels, seen obliquely on an image that is not square.
Scene headScene() {
  Scene scene;
  scene.volume = toAttenuation(headPhantom(6.0), {});
  scene.camera = {45, 37, 170.0, 165.0, 22.3, 17.8};
  scene.T_camera_ct.linear() = rotationFromVector({0.4, -0.3, 1.1});
  scene.T_camera_ct.translation() =
      Eigen::Vector3d(4.0, -3.0, 800.0) - scene.T_camera_ct.linear() * scene.volume.grid.centreCt();
  return scene;
}

PaperRays raysOf(const Scene& scene, int samples) {
  return paperRays(scene.volume.grid, scene.camera, scene.T_camera_ct, samples, true);
}

FloatImage renderWith(PaperEngine* engine, const Scene& scene, int samples) {
  engine->setVolume(scene.volume);
  engine->setTarget(FloatImage(scene.camera.width, scene.camera.height), {}, {});
  engine->render(0, raysOf(scene, samples));
  return engine->read(0);
}

double largestDifference(const FloatImage& a, const FloatImage& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  double largest = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    largest = std::max(largest, static_cast<double>(std::abs(a.pixels[i] - b.pixels[i])));
  }
  return largest;
}

double rootMeanSquareDifference(const FloatImage& a, const FloatImage& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) sum += std::pow(a.pixels[i] - b.pixels[i], 2);
  return std::sqrt(sum / static_cast<double>(a.pixels.size()));
}

std::unique_ptr<PaperEngine> openCl() { return makePaperEngineOpenCl(std::make_shared<Device>()); }

TEST(PaperEngine, OpenClRendersWhatCppRenders) {
  const Scene scene = headScene();
  const auto cpp = makePaperEngineCpp();
  const auto device = openCl();
  const int samples = paperSampleCount(scene.volume.grid, scene.T_camera_ct);
  const FloatImage expected = renderWith(cpp.get(), scene, samples);
  ASSERT_GT(*std::max_element(expected.pixels.begin(), expected.pixels.end()), 1.0F);
  // Line integrals to 10 from about 100 floats in another order, at positions rounded to 1e-5 voxels.
  EXPECT_LT(largestDifference(expected, renderWith(device.get(), scene, samples)), 1e-3);
}

TEST(PaperEngine, ConvergesToTheExactReference) {
  Scene scene = headScene();
  // Averaged over the pixel: the exact projector sees voxel boxes with edges, tri-linear samples do not.
  const FloatImage exact = referenceProjection(scene.volume, scene.T_camera_ct, scene.camera, 3);
  const auto engine = makePaperEngineCpp();
  const double range = *std::max_element(exact.pixels.begin(), exact.pixels.end());
  // Boxes against tri-linear on 6 mm voxels of bone and air differ by a few percent at edges; 2 % of the range in the
  // mean would be a shift of half a voxel or a wrong weight.
  EXPECT_LT(rootMeanSquareDifference(exact, renderWith(engine.get(), scene, 300)), 0.02 * range);
  scene.T_camera_ct.translation().x() += 6.0;
  EXPECT_GT(rootMeanSquareDifference(exact, renderWith(engine.get(), scene, 300)), 0.04 * range);
}

TEST(PaperEngine, LineIntegralOfABoxIsItsLength) {
  Scene scene;
  scene.volume.grid.size = {20, 16, 12};
  scene.volume.grid.spacing_mm = {2.0, 3.0, 4.0};
  scene.volume.scale_per_mm = 1e-4F;
  scene.volume.values.assign(scene.volume.grid.voxelCount(), 200);  // 0.02 per mm.
  scene.camera = {1, 1, 100.0, 100.0, 0.0, 0.0};
  scene.T_camera_ct.translation() = Eigen::Vector3d(0.0, 0.0, 500.0) - scene.volume.grid.centreCt();
  const auto engine = openCl();
  // Along z: 12 voxels of 4 mm. Tri-linear fades over one voxel at each end without changing the integral; the
  // midpoint rule on 2000 samples of a trapezium is good to a step, 0.05 mm of 48.
  EXPECT_NEAR(renderWith(engine.get(), scene, 2000).pixels[0], 0.02 * 48.0, 0.002);
}

TEST(PaperEngine, SourceInsideTheVolumeAndRaysThatMiss) {
  Scene scene = headScene();
  const Eigen::Vector3d centre = scene.volume.grid.centreCt();
  scene.T_camera_ct.translation() = -(scene.T_camera_ct.linear() * centre);  // Source in the centre.
  const auto cpp = makePaperEngineCpp();
  const auto device = openCl();
  const FloatImage expected = renderWith(cpp.get(), scene, 90);
  EXPECT_GT(expected.at(22, 18), 0.1F);
  EXPECT_LT(largestDifference(expected, renderWith(device.get(), scene, 90)), 1e-3);

  scene.T_camera_ct.translation() = Eigen::Vector3d(5000.0, 0.0, 800.0) - scene.T_camera_ct.linear() * centre;
  for (const float value : renderWith(device.get(), scene, 90).pixels) ASSERT_EQ(value, 0.0F);
}

TEST(PaperEngine, SpheresCoverTheVolumeAndShareTheirDistances) {
  const Scene scene = headScene();
  const PaperRays rays = raysOf(scene, 100);
  double nearest = 1e9;
  double farthest = 0.0;
  for (const Eigen::Vector3d& corner : scene.volume.grid.cornersCt()) {
    const double distance = (scene.T_camera_ct * corner).norm();
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, distance);
  }
  EXPECT_LE(rays.first_mm - 0.5 * rays.step_mm, nearest);
  EXPECT_GE(rays.first_mm + (rays.samples - 0.5) * rays.step_mm, farthest);
}

TEST(PaperEngine, PaperGeometryHasTheStatedDistances) {
  const AttenuationVolume cube = toAttenuation(whiteCube(16), {});
  const PaperGeometry geometry = paperGeometry(cube.grid, 16, 200.0);
  EXPECT_TRUE((geometry.T_camera_ct * cube.grid.centreCt()).isApprox(Eigen::Vector3d(0.0, 0.0, 250.0), 1e-12));
  EXPECT_NEAR(geometry.camera.fx * (200.0 / 16), 400.0, 1e-9);  // Source to plane: 4 Lz.
  EXPECT_EQ(paperSampleCount(cube.grid, geometry.T_camera_ct), 48);
}

/// Fills all slots with small motions, against a target that is another pose.
PaperMoments momentsWith(PaperEngine* engine, const Scene& scene, const MaskImage& mask, const PaperFilter& filter) {
  engine->setVolume(scene.volume);
  FloatImage target(scene.camera.width, scene.camera.height);
  for (int v = 0; v < target.height; ++v) {
    for (int u = 0; u < target.width; ++u) target.at(u, v) = 2.0F + std::sin(0.3F * u) + std::cos(0.2F * v);
  }
  engine->setTarget(target, mask, filter);
  const Eigen::Vector3d centre = scene.T_camera_ct * scene.volume.grid.centreCt();
  for (int slot = 0; slot < kPaperSlots; ++slot) {
    Twist twist = Twist::Zero();
    if (slot > 0) twist[slot - 1] = slot < 4 ? 2.0 : 0.02;
    Scene moved = scene;
    moved.T_camera_ct = updatedPose(scene.T_camera_ct, twist, centre);
    engine->render(slot, raysOf(moved, 90));
  }
  return engine->moments({2.0, 2.0, 2.0, 0.02, 0.02, 0.02});
}

MaskImage halfMask(const XrayCamera& camera) {
  MaskImage mask(camera.width, camera.height, 255);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < 9; ++u) mask.at(u, v) = 0;
  }
  return mask;
}

class PaperMomentsTest : public testing::TestWithParam<PaperFilter> {};

TEST_P(PaperMomentsTest, OpenClAddsUpWhatCppAddsUp) {
  const Scene scene = headScene();
  const MaskImage mask = halfMask(scene.camera);
  const auto cpp = makePaperEngineCpp();
  const auto device = openCl();
  const PaperMoments expected = momentsWith(cpp.get(), scene, mask, GetParam());
  const PaperMoments found = momentsWith(device.get(), scene, mask, GetParam());
  EXPECT_EQ(found(7, 7), 36 * 37);  // The allowed pixels.
  for (int k = 0; k < 9; ++k) {
    for (int l = 0; l < 9; ++l) {
      // Differences of images that agree to 1e-4, over steps of 2 mm: relative to the columns' lengths.
      EXPECT_NEAR(found(k, l), expected(k, l), 1e-3 * std::sqrt(expected(k, k) * expected(l, l)) + 1e-6)
          << k << "," << l;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Filters, PaperMomentsTest,
                         testing::Values(PaperFilter{0.0, 0.0}, PaperFilter{1.0, 0.0}, PaperFilter{0.0, 4.0},
                                         PaperFilter{1.0, 4.0}));

TEST(PaperMoments, AreSumsOfTheImagesProducts) {
  const Scene scene = headScene();
  const auto engine = openCl();
  const PaperMoments moments = momentsWith(engine.get(), scene, {}, {});
  const FloatImage f = engine->read(0);
  const FloatImage moved = engine->read(3);
  double ff = 0.0;
  double df = 0.0;
  for (std::size_t i = 0; i < f.pixels.size(); ++i) {
    ff += static_cast<double>(f.pixels[i]) * f.pixels[i];
    df += static_cast<double>(moved.pixels[i] - f.pixels[i]) / 2.0 * f.pixels[i];
  }
  EXPECT_NEAR(moments(6, 6), ff, 1e-5 * ff);  // Float sums of a few dozen pixels per work-item.
  EXPECT_NEAR(moments(2, 6), df, 1e-4 * std::sqrt(ff * moments(2, 2)));
}

TEST(PaperMoments, TheSameInputGivesTheSameBits) {
  const Scene scene = headScene();
  const auto one = openCl();
  const auto other = openCl();
  const PaperMoments a = momentsWith(one.get(), scene, {}, {1.0, 4.0});
  const PaperMoments b = momentsWith(other.get(), scene, {}, {1.0, 4.0});
  EXPECT_EQ(0, std::memcmp(a.data(), b.data(), sizeof(double) * 81));
}

TEST(PaperMoments, BackgroundRemovalTakesAwayWhatIsSmooth) {
  const Scene scene = headScene();
  const auto engine = makePaperEngineCpp();
  engine->setVolume(scene.volume);
  FloatImage constant(scene.camera.width, scene.camera.height, 3.0F);
  engine->setTarget(constant, halfMask(scene.camera), {0.0, 4.0});
  const PaperMoments moments = engine->moments({1, 1, 1, 1, 1, 1});  // Slots are empty: the last column is the target.
  EXPECT_NEAR(moments(8, 8), 0.0, 1e-6);
}

TEST(PaperEngine, WrongOrderOfCallsIsRefused) {
  const Scene scene = headScene();
  for (const auto& engine : {openCl(), makePaperEngineCpp()}) {
    EXPECT_THROW(engine->render(0, raysOf(scene, 30)), std::logic_error);
  }
}

TEST(PaperSelfTest, PassesOnTheDevice) {
  const auto engine = openCl();
  EXPECT_NO_THROW(checkPaperEngine(engine.get()));
}

/// An engine whose pictures are a little too bright.
class WrongEngine : public PaperEngine {
 public:
  void setVolume(const AttenuationVolume& volume) override { engine_->setVolume(volume); }
  void setTarget(const FloatImage& target, const MaskImage& mask, const PaperFilter& filter) override {
    engine_->setTarget(target, mask, filter);
  }
  void render(int slot, const PaperRays& rays) override {
    PaperRays wrong = rays;
    wrong.scale *= 1.01F;
    engine_->render(slot, wrong);
  }
  void finish() override {}
  FloatImage read(int slot) override { return engine_->read(slot); }
  PaperMoments moments(const std::array<double, 6>& steps) override { return engine_->moments(steps); }
  const VolumeGrid& grid() const override { return engine_->grid(); }
  std::string name() const override { return "wrong"; }
  std::size_t deviceBytes() const override { return 0; }

 private:
  std::unique_ptr<PaperEngine> engine_ = makePaperEngineCpp();
};

TEST(PaperSelfTest, RefusesADeviceThatDisagrees) {
  WrongEngine engine;
  EXPECT_THROW(checkPaperEngine(&engine), DeviceError);
}

}  // namespace
}  // namespace xray_registration
