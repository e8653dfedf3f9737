#include "xray_registration/drr/engine.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numeric>
#include <random>

#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/volume/volume_pyramid.h"

namespace xray_registration {
namespace {

/// A smooth blob of overlapping Gaussians: no analytic kinks, so finite differences of the exact derivative converge.
AttenuationVolume smoothVolume(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm, double tilt_rad) {
  AttenuationVolume volume;
  volume.grid.size = size;
  volume.grid.spacing_mm = spacing_mm;
  volume.grid.direction = Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  volume.grid.origin_ct_mm = {-40.0, 25.0, 310.0};
  volume.scale_per_mm = 1e-6F;
  volume.values.resize(volume.grid.voxelCount());
  const Eigen::Vector3d middle = 0.5 * size.cast<double>();
  std::size_t i = 0;
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x, ++i) {
        const Eigen::Vector3d p = (Eigen::Vector3d(x, y, z) - middle).cwiseProduct(spacing_mm);
        const double a = std::exp(-(p - Eigen::Vector3d(6, -3, 4)).squaredNorm() / 180.0);
        const double b = std::exp(-(p - Eigen::Vector3d(-9, 8, -5)).squaredNorm() / 90.0);
        const double c = std::exp(-(p - Eigen::Vector3d(2, 9, 9)).squaredNorm() / 50.0);
        const double value = 30000.0 * a + 20000.0 * b + 12000.0 * c;
        volume.values[i] = value < 30.0 ? 0 : static_cast<std::uint16_t>(value);
      }
    }
  }
  return volume;
}

/// A camera looking at the volume with the optical axis along `axis` of the CT frame, a little askew.
RigidTransform poseLookingAlong(const AttenuationVolume& volume, const Eigen::Vector3d& axis, double depth_mm) {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector({0.11, -0.07, 0.2}) *
                  Eigen::Quaterniond::FromTwoVectors(axis, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(2.0, -3.0, depth_mm) - pose.linear() * anatomicalCentreCt(volume);
  return pose;
}

const Eigen::Vector3d kAxes[] = {Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitX(),    Eigen::Vector3d::UnitY(),
                                 Eigen::Vector3d::UnitZ(), Eigen::Vector3d(1, 0.7, 0.1), Eigen::Vector3d(0.2, 1, 1)};

/// 52 × 44: neither side a whole number of tiles.
const XrayCamera kCamera{52, 44, 400.0, 390.0, 24.0, 22.5};

class EngineTest : public ::testing::Test {
 protected:
  std::shared_ptr<Device> device_ = std::make_shared<Device>("auto");
};

double maximum(const FloatImage& image) { return *std::max_element(image.pixels.begin(), image.pixels.end()); }

TEST_F(EngineTest, ValuesMatchTheExactRayTracer) {
  for (const Eigen::Vector3i& size : {Eigen::Vector3i(48, 48, 48), Eigen::Vector3i(60, 41, 26)}) {
    const Eigen::Vector3d spacing = size.x() == 48 ? Eigen::Vector3d(1, 1, 1) : Eigen::Vector3d(0.8, 1.2, 2.0);
    const AttenuationVolume volume = smoothVolume(size, spacing, size.x() == 48 ? 0.0 : 0.4);
    const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
    engine->setVolume(volume);
    for (const Eigen::Vector3d& axis : kAxes) {
      const RigidTransform pose = poseLookingAlong(volume, axis, 300.0);
      const FloatImage drr = engine->render(kCamera, 0, pose);
      // Detector pixels of the voxel model are averaged, or the boxes' edges would dominate the difference.
      const FloatImage exact = referenceProjection(volume, pose, kCamera, 3);
      const double scale = maximum(exact);
      double sum2 = 0.0;
      for (std::size_t i = 0; i < exact.pixels.size(); ++i) {
        sum2 += std::pow(drr.pixels[i] - exact.pixels[i], 2);
        // Boxes against linear interpolation of a blob 5 voxels wide: 3 % of the maximum at the worst.
        ASSERT_NEAR(drr.pixels[i], exact.pixels[i], 0.03 * scale) << "pixel " << i << " axis " << axis.transpose();
      }
      EXPECT_LT(std::sqrt(sum2 / static_cast<double>(exact.pixels.size())), 0.005 * scale);
      EXPECT_GT(scale, 0.1);
    }
  }
}

TEST_F(EngineTest, DerivativesMatchFiniteDifferences) {
  const AttenuationVolume volume = smoothVolume({50, 44, 36}, {0.9, 1.1, 1.4}, 0.3);
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(volume);
  for (const Eigen::Vector3d& axis : kAxes) {
    const RigidTransform pose = poseLookingAlong(volume, axis, 300.0);
    const std::vector<FloatImage> images = engine->renderWithDerivatives(kCamera, 0, pose);
    const Eigen::Vector3d centre = pose * engine->volume().centreCt();
    for (int i = 0; i < 6; ++i) {
      const double step = i < 3 ? 0.02 : 0.0005;
      const FloatImage plus = engine->render(kCamera, 0, updatedPose(pose, step * Twist::Unit(i), centre));
      const FloatImage minus = engine->render(kCamera, 0, updatedPose(pose, -step * Twist::Unit(i), centre));
      double difference2 = 0.0;
      double size2 = 0.0;
      double largest = 0.0;
      for (std::size_t pixel = 0; pixel < plus.pixels.size(); ++pixel) {
        const double finite = (plus.pixels[pixel] - minus.pixels[pixel]) / (2.0 * step);
        const double exact = images[static_cast<std::size_t>(i) + 1].pixels[pixel];
        difference2 += (finite - exact) * (finite - exact);
        size2 += exact * exact;
        largest = std::max(largest, std::abs(finite - exact) / (std::abs(exact) + 1e-2));
      }
      // Bilinear cells make the derivative jump by a few percent at their borders; a pixel's ray crosses about forty
      // cells, few of them within a step. Two percent over the image leaves no room for a wrong term.
      EXPECT_LT(std::sqrt(difference2 / size2), 0.02) << "twist component " << i << ", axis " << axis.transpose();
      EXPECT_GT(size2, 0.0);
    }
  }
}

TEST_F(EngineTest, DominantAxisMayChangeInsideAnImage) {
  const AttenuationVolume volume = smoothVolume({48, 48, 48}, {1, 1, 1}, 0.0);
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(volume);
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector({0.0, M_PI / 4.0, 0.0});
  pose.translation() = Eigen::Vector3d(0, 0, 60.0) - pose.linear() * anatomicalCentreCt(volume);
  const XrayCamera wide{64, 64, 40.0, 40.0, 31.5, 31.5};  // 77 degrees across.
  const FloatImage drr = engine->render(wide, 0, pose);
  const FloatImage exact = referenceProjection(volume, pose, wide, 3);
  double sum2 = 0.0;
  for (std::size_t i = 0; i < drr.pixels.size(); ++i) sum2 += std::pow(drr.pixels[i] - exact.pixels[i], 2);
  // A pixel is wider than a voxel here and Joseph's ray is thin: 2 % of the maximum in the mean.
  EXPECT_LT(std::sqrt(sum2 / static_cast<double>(drr.pixels.size())), 0.02 * maximum(exact));
}

TEST_F(EngineTest, SourceInsideTheVolumeSeesOnlyWhatIsInFront) {
  const AttenuationVolume volume = smoothVolume({48, 48, 48}, {1, 1, 1}, 0.0);
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(volume);
  const RigidTransform inside = poseLookingAlong(volume, Eigen::Vector3d::UnitX(), 0.0);
  const XrayCamera camera{32, 32, 100.0, 100.0, 15.5, 15.5};
  const FloatImage drr = engine->render(camera, 0, inside);
  const FloatImage exact = referenceProjection(volume, inside, camera, 2);
  // The first slice is counted whole or not at all: half a slice at the densest place.
  const double half_slice = 0.5 * 1.2 * 62000.0 * volume.scale_per_mm;
  for (std::size_t i = 0; i < drr.pixels.size(); ++i) ASSERT_NEAR(drr.pixels[i], exact.pixels[i], half_slice);
}

TEST_F(EngineTest, RaysThatMissAreZero) {
  const AttenuationVolume volume = smoothVolume({32, 32, 32}, {1, 1, 1}, 0.0);
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(volume);
  RigidTransform away = poseLookingAlong(volume, Eigen::Vector3d::UnitY(), 300.0);
  away.translation().x() += 500.0;
  for (const float value : engine->render(kCamera, 0, away).pixels) ASSERT_EQ(value, 0.0F);
  RigidTransform behind = poseLookingAlong(volume, Eigen::Vector3d::UnitY(), -300.0);
  for (const float value : engine->render(kCamera, 0, behind).pixels) ASSERT_EQ(value, 0.0F);
}

TEST_F(EngineTest, SplittingRaysChangesOnlyRounding) {
  const AttenuationVolume volume = smoothVolume({48, 44, 36}, {1, 1, 1}, 0.2);
  const std::unique_ptr<Engine> whole = makeEngineOpenCl(device_);
  const std::unique_ptr<Engine> split = makeEngineOpenCl(device_);
  whole->setVolume(volume);
  split->setVolume(volume);
  whole->forceSplit(1);
  for (const int parts : {2, 4}) {
    split->forceSplit(parts);
    const RigidTransform pose = poseLookingAlong(volume, Eigen::Vector3d(0.1, 1, 0.2), 300.0);
    const auto a = whole->renderWithDerivatives(kCamera, 0, pose);
    const auto b = split->renderWithDerivatives(kCamera, 0, pose);
    for (std::size_t image = 0; image < a.size(); ++image) {
      const double scale = std::max(maximum(a[image]), 1e-6);
      for (std::size_t i = 0; i < a[image].pixels.size(); ++i) {
        // Forty additions in another order, and differences of larger numbers in the chain rule.
        ASSERT_NEAR(a[image].pixels[i], b[image].pixels[i], 2e-4 * scale) << image;
      }
    }
  }
}

// --- Objective ------------------------------------------------------------------------------------------------------

/// What a window is made of, in plain double.
struct Moments {
  double n = 0.0, d = 0.0, x = 0.0, dd = 0.0, xx = 0.0, dx = 0.0;
  void add(double weight, double drr, double xray) {
    dd += weight * drr * drr;
    xx += weight * xray * xray;
    dx += weight * drr * xray;
  }
};

/// The line integrals themselves, with their means.
void addIntensities(const FloatImage& drr, const FloatImage& xray, const FloatImage& weight, int u, int v,
                    Moments* window) {
  const double w = weight.at(u, v);
  window->n += w;
  window->d += w * drr.at(u, v);
  window->x += w * xray.at(u, v);
  window->add(w, drr.at(u, v), xray.at(u, v));
}

/// Gradients over 2 × 2 pixels that are all in one tile; as vectors, without means.
void addGradients(const FloatImage& drr, const FloatImage& xray, const FloatImage& weight, int u, int v,
                  Moments* window) {
  if (u % 8 == 7 || v % 8 == 7 || u + 1 >= drr.width || v + 1 >= drr.height) return;
  const double w = std::min({weight.at(u, v), weight.at(u + 1, v), weight.at(u, v + 1), weight.at(u + 1, v + 1)});
  const auto gradient = [&](const FloatImage& image) -> Eigen::Vector2d {
    const double a = image.at(u, v), b = image.at(u + 1, v), c = image.at(u, v + 1), d = image.at(u + 1, v + 1);
    return {0.5 * (b - a + d - c), 0.5 * (c - a + d - b)};
  };
  window->n += w;
  for (int i = 0; i < 2; ++i) window->add(w, gradient(drr)[i], gradient(xray)[i]);
}

/// The objective in plain double, from rendered images.
double referenceObjective(const FloatImage& drr, const FloatImage& xray, const FloatImage& weight,
                          const WindowOptions& options) {
  const int tiles_x = (drr.width + 7) / 8;
  const int tiles_y = (drr.height + 7) / 8;
  const int span_x = options.span == 0 ? tiles_x : options.span;
  const int span_y = options.span == 0 ? tiles_y : options.span;
  const double min_weight = options.span == 0 ? 64.0 : 0.25 * 64 * span_x * span_y;
  const auto add = options.similarity == Similarity::kGradientCorrelation ? addGradients : addIntensities;
  double cost = 0.0;
  for (int wy = 0; wy + span_y <= tiles_y; ++wy) {
    for (int wx = 0; wx + span_x <= tiles_x; ++wx) {
      Moments m;
      for (int v = 8 * wy; v < std::min(8 * (wy + span_y), drr.height); ++v) {
        for (int u = 8 * wx; u < std::min(8 * (wx + span_x), drr.width); ++u) add(drr, xray, weight, u, v, &m);
      }
      if (m.n < min_weight) continue;
      const double var_d = m.dd / m.n - m.d * m.d / m.n / m.n + options.epsilon_value * options.epsilon_value;
      const double plain_x = m.xx / m.n - m.x * m.x / m.n / m.n;
      const double var_x = plain_x + options.epsilon_xray * options.epsilon_xray;
      const double e = 1.0 - (m.dx / m.n - m.d * m.x / m.n / m.n) / std::sqrt(var_d * var_x);
      cost += m.n * plain_x / (plain_x + options.contrast * options.contrast) * e * options.robust_scale2 /
              (e + options.robust_scale2);
    }
  }
  return cost;
}

struct Scene {
  AttenuationVolume volume = smoothVolume({48, 44, 36}, {1, 1, 1}, 0.2);
  RigidTransform pose = poseLookingAlong(volume, Eigen::Vector3d(0.1, 1, 0.2), 300.0);
  FloatImage xray{kCamera.width, kCamera.height};
  FloatImage weight{kCamera.width, kCamera.height, 1.0F};
};

Scene sceneSeenBy(Engine* engine) {
  Scene scene;
  engine->setVolume(scene.volume);
  Twist off;
  off << 0.8, -0.5, 3.0, 0.02, -0.03, 0.015;
  const Eigen::Vector3d centre = scene.pose * engine->volume().centreCt();
  scene.xray = engine->render(kCamera, 0, updatedPose(scene.pose, off, centre));
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0.0F, 0.02F);
  for (float& pixel : scene.xray.pixels) pixel = 1.3F * pixel + 0.4F + noise(random);
  for (int v = 10; v < 20; ++v) {
    for (int u = 12; u < 22; ++u) scene.weight.at(u, v) = 0.0F;
  }
  for (int u = 0; u < 52; ++u) scene.weight.at(u, 30) = 0.5F;
  return scene;
}

/// 144 × 132, levels of 72 and 36; the CT ends where the image still sees it.
const XrayCamera kDetector{144, 132, 1100.0, 1080.0, 70.0, 66.0};

Scene largeSceneSeenBy(Engine* engine) {
  Scene scene;
  scene.volume.face_is_cut = {true, true, true, true, true, true};
  // Tissue up to the faces, or nothing would be cut.
  for (std::uint16_t& value : scene.volume.values) value = std::max<std::uint16_t>(value, 20000);
  engine->setVolume(scene.volume);
  const Eigen::Vector3d centre = scene.pose * engine->volume().centreCt();
  scene.xray = engine->render(kDetector, 0, updatedPose(scene.pose, 0.01 * Twist::Ones(), centre));
  scene.weight = FloatImage(kDetector.width, kDetector.height, 1.0F);
  return scene;
}

std::vector<WindowOptions> objectives() {
  WindowOptions local;
  WindowOptions one_tile = local;
  one_tile.span = 1;
  WindowOptions global = local;
  global.span = 0;
  WindowOptions robust = local;
  robust.robust_scale2 = 0.3;
  robust.contrast = 0.0;
  std::vector<WindowOptions> all = {local, one_tile, global, robust};
  for (WindowOptions options : {local, one_tile, global, robust}) {
    options.similarity = Similarity::kGradientCorrelation;
    options.epsilon_value = options.epsilon_xray = 0.001;
    options.contrast *= 0.1;
    all.push_back(options);
  }
  return all;
}

std::string nameOf(const WindowOptions& options) {
  return std::string(kindOf(options.similarity).name) + ", span " + std::to_string(options.span);
}

TEST_F(EngineTest, ObjectiveMatchesThePlainReference) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const Scene scene = sceneSeenBy(engine.get());
  const std::unique_ptr<ResidentXray> xray = engine->upload(kCamera, scene.xray, scene.weight);
  const FloatImage drr = engine->render(kCamera, 0, scene.pose);
  for (const WindowOptions& options : objectives()) {
    const StepSums sums = engine->evaluate(xray.get(), 0, 0, {scene.pose}, options)[0];
    const double expected = referenceObjective(drr, scene.xray, scene.weight, options);
    // Small differences of sums over 2000 pixels in float.
    EXPECT_NEAR(sums.cost, expected, 1e-3 * expected) << nameOf(options);
  }
}

TEST_F(EngineTest, TilesThatSeeNoTissueCountWithTheirXray) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  Scene scene;
  engine->setVolume(scene.volume);
  const XrayCamera camera{144, 132, 400.0, 390.0, 70.0, 66.0};  // The CT covers a quarter of it.
  const Eigen::Vector3d centre = scene.pose * engine->volume().centreCt();
  FloatImage seen = engine->render(camera, 0, updatedPose(scene.pose, 0.01 * Twist::Ones(), centre));
  std::mt19937 random(9);
  std::normal_distribution<float> noise(0.0F, 0.05F);
  for (int v = 0; v < seen.height; ++v) {
    for (int u = 0; u < seen.width; ++u) seen.at(u, v) += 0.7F + 0.01F * static_cast<float>(u) + noise(random);
  }
  FloatImage weight(camera.width, camera.height, 1.0F);
  for (int u = 0; u < camera.width; ++u) weight.at(u, 8) = 0.3F;
  const std::unique_ptr<ResidentXray> xray = engine->upload(camera, seen, weight);
  const FloatImage drr = engine->render(camera, 0, scene.pose);
  const auto air = std::count(drr.pixels.begin(), drr.pixels.end(), 0.0F);
  ASSERT_GT(air, 144 * 132 / 2);
  for (const WindowOptions& options : objectives()) {
    const double expected = referenceObjective(drr, seen, weight, options);
    // As for a CT that covers the image: sums of single precision.
    EXPECT_NEAR(engine->evaluate(xray.get(), 0, 0, {scene.pose}, options)[0].cost, expected, 1e-3 * expected)
        << nameOf(options);
  }
}

TEST_F(EngineTest, GradientIsTheObjectivesAndTheMatrixIsPositive) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const Scene scene = sceneSeenBy(engine.get());
  const std::unique_ptr<ResidentXray> xray = engine->upload(kCamera, scene.xray, scene.weight);
  const Eigen::Vector3d centre = scene.pose * engine->volume().centreCt();
  for (const WindowOptions& options : objectives()) {
    const StepSums sums = engine->evaluate(xray.get(), 0, 0, {scene.pose}, options)[0];
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(sums.matrix).eigenvalues().minCoeff(), 0.0);
    for (int i = 0; i < 6; ++i) {
      const double step = i < 3 ? 0.05 : 0.001;
      const double plus =
          referenceObjective(engine->render(kCamera, 0, updatedPose(scene.pose, step * Twist::Unit(i), centre)),
                             scene.xray, scene.weight, options);
      const double minus =
          referenceObjective(engine->render(kCamera, 0, updatedPose(scene.pose, -step * Twist::Unit(i), centre)),
                             scene.xray, scene.weight, options);
      const double finite = (plus - minus) / (2.0 * step);
      // Second order in the step plus the bilinear cells' kinks; the scale is the gradient's own size per component.
      const double scale = std::sqrt(sums.matrix(i, i) * sums.cost);
      EXPECT_NEAR(sums.gradient[i], finite, 0.01 * scale) << "component " << i << ", " << nameOf(options);
    }
  }
}

TEST_F(EngineTest, SharedRaysChangeOnlyTheSumsRounding) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const Scene scene = sceneSeenBy(engine.get());
  const std::unique_ptr<ResidentXray> xray = engine->upload(kCamera, scene.xray, scene.weight);
  for (const WindowOptions& options : objectives()) {
    engine->forceSplit(1);
    const StepSums whole = engine->evaluate(xray.get(), 0, 0, {scene.pose}, options)[0];
    for (const int parts : {2, 4}) {
      engine->forceSplit(parts);
      const StepSums split = engine->evaluate(xray.get(), 0, 0, {scene.pose}, options)[0];
      // As the pictures: differences of larger numbers, in another order.
      EXPECT_NEAR(split.cost, whole.cost, 1e-3 * whole.cost) << nameOf(options) << ", " << parts;
      for (int i = 0; i < 6; ++i) {
        EXPECT_NEAR(split.gradient[i], whole.gradient[i], 1e-3 * std::sqrt(whole.matrix(i, i) * whole.cost))
            << nameOf(options) << ", " << parts;
      }
    }
  }
}

TEST_F(EngineTest, BatchGivesWhatSinglePosesGive) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const Scene scene = sceneSeenBy(engine.get());
  const std::unique_ptr<ResidentXray> xray = engine->upload(kCamera, scene.xray, scene.weight);
  const Eigen::Vector3d centre = scene.pose * engine->volume().centreCt();
  std::vector<RigidTransform> poses;
  for (int i = 0; i < 5; ++i) poses.push_back(updatedPose(scene.pose, 0.01 * i * Twist::Ones(), centre));
  const std::vector<StepSums> batch = engine->evaluate(xray.get(), 0, 0, poses, {});
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const StepSums single = engine->evaluate(xray.get(), 0, 0, {poses[i]}, {})[0];
    EXPECT_EQ(single.cost, batch[i].cost);
    EXPECT_EQ(single.matrix, batch[i].matrix);
    EXPECT_EQ(single.gradient, batch[i].gradient);
  }
}

TEST_F(EngineTest, EqualInputGivesEqualBits) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const Scene scene = sceneSeenBy(engine.get());
  const std::unique_ptr<ResidentXray> xray = engine->upload(kCamera, scene.xray, scene.weight);
  const StepSums first = engine->evaluate(xray.get(), 0, 0, {scene.pose}, {})[0];
  for (int i = 0; i < 10; ++i) {
    const StepSums again = engine->evaluate(xray.get(), 0, 0, {scene.pose}, {})[0];
    ASSERT_EQ(first.cost, again.cost);
    ASSERT_EQ(first.matrix, again.matrix);
    ASSERT_EQ(first.gradient, again.gradient);
  }
}

/// What a tracked frame does with an X-ray.
void trackOnce(Engine* engine, const Scene& scene) {
  const std::unique_ptr<ResidentXray> xray = engine->upload(kDetector, scene.xray, scene.weight);
  engine->weighUnexplained(xray.get(), scene.pose, 1.0);
  engine->evaluate(xray.get(), 1, 0, {scene.pose}, {});
  engine->keepContrastTiles(xray.get(), 0, 0.65);
  engine->evaluate(xray.get(), 0, 0, {scene.pose}, {});
}

TEST_F(EngineTest, ATrackedFrameHalvesOnceAndMakesNoBuffers) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const Scene scene = largeSceneSeenBy(engine.get());
  trackOnce(engine.get(), scene);
  const EngineWork before = engine->work();
  trackOnce(engine.get(), scene);
  const EngineWork after = engine->work();
  EXPECT_EQ(after.buffers, before.buffers) << "the last frame's are used again";
  EXPECT_EQ(after.halvings - before.halvings, 1U) << "the level below the finest, with the weights that count";
  // The map of unexplained rays and its use, one halving, the tiles of two levels, twice plan, march and windows.
  EXPECT_EQ(after.launches - before.launches, 2U + 1U + 2U + 6U);
}

TEST_F(EngineTest, WhatIsAskedForFirstChangesNoSum) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const Scene scene = largeSceneSeenBy(engine.get());
  const std::unique_ptr<ResidentXray> fine_first = engine->upload(kDetector, scene.xray, scene.weight);
  const std::unique_ptr<ResidentXray> coarse_first = engine->upload(kDetector, scene.xray, scene.weight);
  ASSERT_EQ(fine_first->lastLevel(), 2);
  const auto sums = [&](const std::unique_ptr<ResidentXray>& xray, int level) {
    return engine->evaluate(xray.get(), level, 0, {scene.pose}, {})[0];
  };
  engine->weighUnexplained(fine_first.get(), scene.pose, 1.0);
  engine->weighUnexplained(coarse_first.get(), scene.pose, 1.0);
  std::vector<StepSums> ascending, descending;
  for (int level = 0; level <= 2; ++level) ascending.push_back(sums(fine_first, level));
  for (int level = 2; level >= 0; --level) descending.push_back(sums(coarse_first, level));
  for (std::size_t level = 0; level < 3; ++level) {
    EXPECT_EQ(ascending[level].matrix, descending[2 - level].matrix) << "level " << level;
    EXPECT_EQ(ascending[level].cost, descending[2 - level].cost) << "level " << level;
  }
}

/// Millimetres that a ray runs through the box, or through it without end in z.
double lengthInside(const Eigen::Vector3d& source, const Eigen::Vector3d& direction, const Eigen::Vector3d& low,
                    const Eigen::Vector3d& high, int axes) {
  double enters = 0.0;
  double leaves = 1e9;
  for (int axis = 0; axis < axes; ++axis) {
    const double a = (low[axis] - source[axis]) / direction[axis];
    const double b = (high[axis] - source[axis]) / direction[axis];
    enters = std::max(enters, std::min(a, b));
    leaves = std::min(leaves, std::max(a, b));
  }
  return std::max(leaves - enters, 0.0);
}

double interpolated(const FloatImage& image, double x, double y) {
  const int u = static_cast<int>(x);
  const int v = static_cast<int>(y);
  const double top = image.at(u, v) + (x - u) * (image.at(u + 1, v) - image.at(u, v));
  const double bottom = image.at(u, v + 1) + (x - u) * (image.at(u + 1, v + 1) - image.at(u, v + 1));
  return top + (y - v) * (bottom - top);
}

TEST_F(EngineTest, UnexplainedIsTheTissueThatGoesOnBehindCutFaces) {
  AttenuationVolume volume;
  volume.grid.size = {30, 26, 20};
  volume.grid.spacing_mm = {5.0, 5.0, 5.0};
  volume.grid.origin_ct_mm = {-40.0, 25.0, 310.0};
  volume.scale_per_mm = 1e-6F;
  volume.values.assign(volume.grid.voxelCount(), 20000);
  volume.face_is_cut = {false, false, false, false, true, true};
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(volume);
  const XrayCamera camera{200, 190, 800.0, 780.0, 95.0, 97.0};
  const Eigen::Vector3d half = 0.5 * volume.grid.spacing_mm;
  const Eigen::Vector3d low = volume.grid.origin_ct_mm - half;
  const Eigen::Vector3d high = low + volume.grid.size.cast<double>().cwiseProduct(volume.grid.spacing_mm);
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0.1, 1, 0.2), Eigen::Vector3d(-1, 0.3, 0.1)}) {
    const RigidTransform pose = poseLookingAlong(volume, axis, 900.0);
    const std::unique_ptr<ResidentXray> xray =
        engine->upload(camera, FloatImage(camera.width, camera.height), FloatImage(camera.width, camera.height, 1.0F));
    constexpr double kLimit = 2.0;
    constexpr int kStep =
        4;  // Pixels between the points that are looked at, from the image's first to behind its last.
    FloatImage expected(camera.width / kStep + 2, camera.height / kStep + 2);
    for (int v = 0; v < expected.height; ++v) {
      for (int u = 0; u < expected.width; ++u) {
        const Eigen::Vector3d direction =
            (pose.linear().transpose() * camera.rayDirection(kStep * u, kStep * v)).normalized();
        const Eigen::Vector3d source = pose.inverse().translation();
        const double unexplained_mm =
            lengthInside(source, direction, low, high, 2) - lengthInside(source, direction, low, high, 3);
        expected.at(u, v) = static_cast<float>(1.0 / (1.0 + std::pow(0.02 * unexplained_mm / kLimit, 2)));
      }
    }
    const double mean = std::accumulate(expected.pixels.begin(), expected.pixels.end(), 0.0) /
                        static_cast<double>(expected.pixels.size());
    ASSERT_LT(mean, 0.9) << "a scene without unexplained tissue";
    // A ray is sampled about every 3 mm, 0.07 of a line integral of up to 3; what is left out or too much at either end
    // evens out over the points.
    EXPECT_NEAR(engine->weighUnexplained(xray.get(), pose, kLimit), mean, 0.003);

    const TileProducts tiles = engine->addUpTiles(xray.get(), 0, 0, camera, pose, {});
    for (int tile_v = 0; tile_v < tiles.tiles_y; ++tile_v) {
      for (int tile_u = 0; tile_u < tiles.tiles_x; ++tile_u) {
        double weight = 0.0;
        for (int v = 8 * tile_v; v < std::min(8 * tile_v + 8, camera.height); ++v) {
          for (int u = 8 * tile_u; u < std::min(8 * tile_u + 8, camera.width); ++u) {
            const double factor = interpolated(expected, u / 4.0, v / 4.0);
            weight += factor < 0.05 ? 0.0 : factor;
          }
        }
        // 0.07 of a line integral is 0.023 of a weight where that is steepest.
        EXPECT_NEAR(tiles.tile(tile_u, tile_v)[0], weight, 64 * 0.025) << "tile " << tile_u << ", " << tile_v;
      }
    }
  }
}

TEST_F(EngineTest, RestoredWeightsReachEveryLevel) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const Scene scene = largeSceneSeenBy(engine.get());
  const std::unique_ptr<ResidentXray> untouched = engine->upload(kDetector, scene.xray, scene.weight);
  const std::unique_ptr<ResidentXray> xray = engine->upload(kDetector, scene.xray, scene.weight);
  const auto weightOf = [&](const std::unique_ptr<ResidentXray>& seen, int level) {
    return engine->evaluate(seen.get(), level, 0, {scene.pose}, {})[0].weight;
  };
  const auto weigh = [&] {
    ASSERT_LT(engine->weighUnexplained(xray.get(), scene.pose, 1.0), 0.98);
    for (int level = 0; level <= 2; ++level) EXPECT_LT(weightOf(xray, level), weightOf(untouched, level)) << level;
  };
  const auto restore = [&] {
    engine->restoreWeights(xray.get());
    for (int level = 0; level <= 2; ++level) EXPECT_EQ(weightOf(xray, level), weightOf(untouched, level)) << level;
  };
  weigh();
  restore();
  engine->keepContrastTiles(xray.get(), 0, 0.3);
  EXPECT_LT(weightOf(xray, 0), weightOf(untouched, 0)) << "a part of the tiles";
  restore();
  weigh();
}

TEST_F(EngineTest, StorageOfOneXrayCarriesNothingIntoTheNext) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const Scene scene = largeSceneSeenBy(engine.get());
  const auto sums = [&](ResidentXray* xray) { return engine->evaluate(xray, 1, 0, {scene.pose}, {})[0]; };
  std::unique_ptr<ResidentXray> xray = engine->upload(kDetector, scene.xray, scene.weight);
  const StepSums fresh = sums(xray.get());
  // A larger one with other weights, of which only a part of the tiles is used, then a smaller one.
  const XrayCamera larger{168, 176, 500.0, 500.0, 84.0, 88.0};
  xray.reset();
  xray = engine->upload(larger, FloatImage(larger.width, larger.height, 2.0F),
                        FloatImage(larger.width, larger.height, 0.25F));
  sums(xray.get());
  engine->keepContrastTiles(xray.get(), 0, 0.1);
  xray.reset();
  xray = engine->upload(kDetector, scene.xray, scene.weight);
  const StepSums again = sums(xray.get());
  EXPECT_EQ(fresh.matrix, again.matrix);
  EXPECT_EQ(fresh.cost, again.cost);
}

TEST_F(EngineTest, XraysOfAnotherKindAreRefused) {
  class OtherXray : public ResidentXray {
    void limitTo(const std::vector<PixelBox>&) override {}
    void leaveOut(const std::vector<PixelBox>&) override {}
    void forgetSurroundings() override {}
    bool isSurrounded(int) const override { return false; }
  } other;
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(smoothVolume({24, 24, 24}, {1, 1, 1}, 0.0));
  EXPECT_THROW(engine->evaluate(&other, 0, 0, {RigidTransform::Identity()}, {}), std::invalid_argument);
}

TEST_F(EngineTest, MemoryOfALargeCtStaysWithinItsBudget) {
  AttenuationVolume volume;
  volume.grid.size = {400, 400, 230};  // Smaller ones have their voxels twice on a CPU.
  volume.scale_per_mm = 1e-6F;
  volume.values.assign(volume.grid.voxelCount(), 1000);
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(volume);
  EXPECT_LE(engine->volume().bytes(), volume.values.size() * sizeof(std::uint16_t) * 5 / 2);
}

/// A body among its surroundings, an X-ray of both from another pose of the body.
struct BodyScene {
  AttenuationVolume volume = smoothVolume({48, 48, 48}, {1, 1, 1}, 0.0);
  AttenuationVolume around = smoothVolume({40, 52, 44}, {1.1, 0.9, 1.2}, 0.5);
  RigidTransform pose = poseLookingAlong(volume, Eigen::Vector3d::UnitY(), 300.0);
  RigidTransform pose_around = updatedPose(pose, (Twist() << 6, -4, 9, 0.1, 0.3, -0.2).finished(), {0, 0, 300});
};

FloatImage sumOf(const FloatImage& a, const FloatImage& b) {
  FloatImage sum = a;
  for (std::size_t i = 0; i < sum.pixels.size(); ++i) sum.pixels[i] += b.pixels[i];
  return sum;
}

TEST_F(EngineTest, LineIntegralsOfBodiesAdd) {
  const BodyScene scene;
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(scene.volume);
  const std::unique_ptr<Engine> other = engine->sibling();
  other->setVolume(scene.around);
  const FloatImage xray = sumOf(engine->render(kCamera, 0, scene.pose), other->render(kCamera, 0, scene.pose_around));
  const FloatImage weight(kCamera.width, kCamera.height, 1.0F);
  const auto whole = engine->upload(kCamera, xray, weight);
  const auto look = engine->share(whole.get());
  const WindowOptions options = windowsFor(Similarity::kLocalNormalised, whole->deviation());
  const auto similarity = [&](ResidentXray* seen) {
    return engine->evaluate(seen, 0, 0, {scene.pose}, options).front().similarity;
  };
  const double alone = similarity(look.get());
  other->surround(look.get(), 0, 0, scene.pose_around);
  EXPECT_TRUE(look->isSurrounded(0));
  EXPECT_FALSE(whole->isSurrounded(0));
  // What is compared is the X-ray itself, but for the contrast that counts as flat.
  EXPECT_GT(similarity(look.get()), 0.99);
  EXPECT_LT(alone, 0.95);
  EXPECT_EQ(similarity(whole.get()), alone);
  look->forgetSurroundings();
  EXPECT_EQ(similarity(look.get()), alone);
}

TEST_F(EngineTest, SurroundingsOfManyLooksAreDrawnOneBehindTheOther) {
  // Nothing is read back in between, so a pose may only be overwritten once it was sent.
  const BodyScene scene;
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(scene.volume);
  const FloatImage xray = engine->render(kCamera, 0, scene.pose);
  const auto whole = engine->upload(kCamera, xray, FloatImage(kCamera.width, kCamera.height, 1.0F));
  constexpr int kLooks = 8;
  const auto sums = [&](bool wait) {
    std::vector<std::unique_ptr<ResidentXray>> looks;
    for (int i = 0; i < kLooks; ++i) {
      looks.push_back(engine->share(whole.get()));
      engine->surround(looks.back().get(), 0, 0, updatedPose(scene.pose, 3.0 * i * Twist::Unit(0), {0, 0, 300}));
      if (wait) engine->device().finish();
    }
    std::vector<std::vector<float>> all;
    for (const auto& look : looks) all.push_back(engine->addUpBody(look.get(), 0, 0, scene.pose).sums);
    return all;
  };
  const auto waited = sums(true);
  EXPECT_EQ(waited, sums(false));
  EXPECT_NE(waited[0], waited[1]);
}

TEST_F(EngineTest, SurroundingsAreCopiedFromAnotherLook) {
  const BodyScene scene;
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(scene.volume);
  const FloatImage xray = engine->render(kCamera, 0, scene.pose);
  const auto whole = engine->upload(kCamera, xray, FloatImage(kCamera.width, kCamera.height, 1.0F));
  const auto backdrop = engine->share(whole.get());
  const auto look = engine->share(whole.get());
  const auto sums = [&](ResidentXray* seen) { return engine->addUpBody(seen, 0, 0, scene.pose).sums; };
  const auto alone = sums(look.get());
  engine->surround(look.get(), 0, 0, scene.pose);  // Is replaced, not added to.
  engine->surround(backdrop.get(), 0, 0, scene.pose_around);
  engine->surroundAs(look.get(), 0, backdrop.get());
  EXPECT_TRUE(look->isSurrounded(0));
  EXPECT_EQ(sums(look.get()), sums(backdrop.get()));
  EXPECT_NE(sums(look.get()), alone);
  backdrop->forgetSurroundings();
  engine->surroundAs(look.get(), 0, backdrop.get());
  EXPECT_FALSE(look->isSurrounded(0));
  EXPECT_EQ(sums(look.get()), alone);
}

TEST_F(EngineTest, ABodysSumsAreThoseOfItsPartsAndDerivatives) {
  const BodyScene scene;
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(scene.volume);
  const std::unique_ptr<Engine> other = engine->sibling();
  other->setVolume(scene.around);
  const FloatImage around = other->render(kCamera, 0, scene.pose_around);
  const std::vector<FloatImage> body = engine->renderWithDerivatives(kCamera, 0, scene.pose);
  const FloatImage weight(kCamera.width, kCamera.height, 1.0F);
  for (const double saturation : {0.0, 0.4}) {
    const auto xray = engine->upload(kCamera, sumOf(body.front(), around), weight);
    xray->setSaturation(saturation);
    other->surround(xray.get(), 0, 0, scene.pose_around);
    const TileProducts products = engine->addUpBody(xray.get(), 0, 0, scene.pose);
    ASSERT_EQ(products.vectors, 10);
    const float* tile = products.tile(2, 2);
    const float* reference = tile + products.pairs();
    // Tile (2, 2) by the images.
    double sum_value = 0.0;
    double sum_body = 0.0;
    double body_by_x = 0.0;
    for (int v = 16; v < 24; ++v) {
      for (int u = 16; u < 24; ++u) {
        const auto pixel = static_cast<std::size_t>(v * kCamera.width + u);
        const double all = body[0].pixels[pixel] + around.pixels[pixel];
        const double passed = saturation > 0.0 ? std::exp(-all / saturation) : 1.0;
        sum_value += (saturation > 0.0 ? saturation * (1.0 - passed) : all) - reference[0];
        sum_body += passed * body[0].pixels[pixel];
        body_by_x += passed * passed * body[0].pixels[pixel] * body[1].pixels[pixel];
      }
    }
    // Pairs (0, j) stand first; (9, 9) is last, (3, 9) at 10 + 9 + 8 + 6. Single precision.
    EXPECT_NEAR(tile[1], sum_value, 1e-4 * std::abs(sum_value) + 1e-4);
    EXPECT_NEAR(tile[9], sum_body, 1e-4 * sum_body);
    EXPECT_NEAR(tile[10 + 9 + 8 + 6], body_by_x, 1e-3 * std::abs(body_by_x) + 1e-6);
    EXPECT_GT(std::abs(body_by_x), 1e-4);
  }
}

TEST_F(EngineTest, TilesBesideTheBoxAreNotUsed) {
  const BodyScene scene;
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(scene.volume);
  const FloatImage xray = engine->render(kCamera, 0, scene.pose);
  const auto whole = engine->upload(kCamera, xray, FloatImage(kCamera.width, kCamera.height, 1.0F));
  const auto look = engine->share(whole.get());
  const auto used = [&](ResidentXray* seen, int x, int y) {
    return engine->addUpBody(seen, 0, 0, scene.pose).tile(x, y)[0] > 0.0F;
  };
  look->limitTo({{17.0, 9.0, 30.0, 20.0}});
  EXPECT_TRUE(used(look.get(), 2, 1));
  EXPECT_TRUE(used(look.get(), 3, 2));
  EXPECT_FALSE(used(look.get(), 1, 1));
  EXPECT_FALSE(used(look.get(), 2, 3));
  EXPECT_TRUE(used(whole.get(), 1, 1));
  look->limitTo({{17.0, 9.0, 30.0, 20.0}, {1.0, 9.0, 2.0, 10.0}});
  EXPECT_TRUE(used(look.get(), 2, 1));
  EXPECT_TRUE(used(look.get(), 0, 1));
  EXPECT_FALSE(used(look.get(), 1, 1));
  look->limitTo({});
  EXPECT_TRUE(used(look.get(), 1, 1));
  look->leaveOut({{17.0, 9.0, 30.0, 20.0}});
  EXPECT_FALSE(used(look.get(), 2, 1));
  EXPECT_TRUE(used(look.get(), 1, 1));
}

}  // namespace
}  // namespace xray_registration
