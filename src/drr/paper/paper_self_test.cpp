#include <cmath>

#include "xray_registration/drr/paper/paper_engine.h"
#include "xray_registration/drr/self_test.h"

namespace xray_registration {
namespace {

/// A bright block off the centre of a box of varying values: no symmetry hides a swapped axis.
AttenuationVolume smallScene() {
  AttenuationVolume volume;
  volume.grid.size = {12, 10, 8};
  volume.grid.spacing_mm = {1.0, 1.2, 1.5};
  volume.grid.origin_ct_mm = {-6.0, -5.0, -4.0};
  volume.scale_per_mm = 1e-5F;
  volume.values.resize(volume.grid.voxelCount());
  std::size_t i = 0;
  for (int z = 0; z < 8; ++z) {
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 12; ++x, ++i) {
        const bool block = x > 2 && x < 6 && y > 4 && z > 1 && z < 4;
        volume.values[i] = static_cast<std::uint16_t>((block ? 3000 : 1000) + 37 * x + 53 * y + 71 * z);
      }
    }
  }
  return volume;
}

PaperMoments renderScene(PaperEngine* engine, const AttenuationVolume& volume) {
  XrayCamera camera{19, 17, 60.0, 61.0, 9.2, 7.9};
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() = rotationFromVector({0.3, -0.5, 0.4});
  T_camera_ct.translation() = Eigen::Vector3d(0.5, -0.7, 50.0);
  FloatImage target(camera.width, camera.height);
  for (std::size_t i = 0; i < target.pixels.size(); ++i) target.pixels[i] = 0.01F * static_cast<float>(i % 13);
  engine->setVolume(volume);
  engine->setTarget(target, {}, {1.0, 3.0});
  for (int slot = 0; slot < kPaperSlots; ++slot) {
    Twist twist = Twist::Zero();
    if (slot > 0) twist[slot - 1] = slot < 4 ? 0.3 : 0.05;
    const RigidTransform pose = updatedPose(T_camera_ct, twist, T_camera_ct * volume.grid.centreCt());
    engine->render(slot, paperRays(volume.grid, camera, pose, 24, true));
  }
  return engine->moments({0.3, 0.3, 0.3, 0.05, 0.05, 0.05});
}

}  // namespace

void checkPaperEngine(PaperEngine* engine) {
  const AttenuationVolume volume = smallScene();
  const std::unique_ptr<PaperEngine> reference = makePaperEngineCpp();
  const PaperMoments expected = renderScene(reference.get(), volume);
  const PaperMoments found = renderScene(engine, volume);
  for (int slot = 0; slot < kPaperSlots; ++slot) {
    // Sums of 24 floats differ by the order of operations only.
    checkPicture(engine->name(), engine->read(slot), reference->read(slot), 3e-4);
  }
  for (int k = 0; k < 9; ++k) {
    for (int l = 0; l < 9; ++l) {
      const double size = std::sqrt(expected(k, k) * expected(l, l));
      if (!(std::abs(expected(k, l) - found(k, l)) <= 1e-3 * size)) {
        throw DeviceError("self-test of the paper method: '" + engine->name() + "' adds up wrong sums (" +
                              std::to_string(found(k, l)) + " for " + std::to_string(expected(k, l)) +
                              "); the device is not used",
                          0);
      }
    }
  }
}

}  // namespace xray_registration
