#include "xray_registration/drr/self_test.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "xray_registration/drr/reference_projector.h"

namespace xray_registration {
namespace {

constexpr int kVoxels = 24;
constexpr double kDepthMm = 200.0;

/// A smooth, lopsided blob.
AttenuationVolume blob() {
  AttenuationVolume volume;
  volume.grid.size = Eigen::Vector3i::Constant(kVoxels);
  volume.grid.spacing_mm = Eigen::Vector3d(1.0, 1.1, 1.2);
  volume.scale_per_mm = 1e-6F;
  for (int z = 0; z < kVoxels; ++z) {
    for (int y = 0; y < kVoxels; ++y) {
      for (int x = 0; x < kVoxels; ++x) {
        const Eigen::Vector3d p(x, y, z);
        const double value = 40000.0 * std::exp(-(p - Eigen::Vector3d(13, 11, 12)).squaredNorm() / 30.0) +
                             20000.0 * std::exp(-(p - Eigen::Vector3d(8, 15, 9)).squaredNorm() / 12.0);
        volume.values.push_back(value < 50.0 ? 0 : static_cast<std::uint16_t>(value));
      }
    }
  }
  return volume;
}

/// What is wrong with the picture, in words; empty when nothing is.
std::string faultOf(const FloatImage& rendered, const FloatImage& reference, double tolerance) {
  if (rendered.width != reference.width || rendered.height != reference.height) return "of another size";
  double difference = 0.0;
  double brightest = 0.0;
  for (std::size_t i = 0; i < reference.pixels.size(); ++i) {
    if (!std::isfinite(rendered.pixels[i])) return "with a pixel that is not finite";
    difference = std::max(difference, std::abs(static_cast<double>(rendered.pixels[i]) - reference.pixels[i]));
    brightest = std::max(brightest, static_cast<double>(reference.pixels[i]));
  }
  if (difference <= tolerance * brightest) return "";
  std::ostringstream text;
  text << 100.0 * difference / brightest << " % off the reference";
  return text.str();
}

}  // namespace

void checkPicture(const std::string& device, const FloatImage& rendered, const FloatImage& reference,
                  double tolerance) {
  const std::string fault = faultOf(rendered, reference, tolerance);
  if (fault.empty()) return;
  throw DeviceError(
      "the self-test failed: '" + device + "' renders a DRR " + fault + "; update its driver or choose another device",
      0);
}

void selfTest(Engine* engine) {
  const AttenuationVolume volume = blob();
  engine->setVolume(volume);
  const XrayCamera camera{40, 36, 260.0, 260.0, 19.0, 18.0};
  const Eigen::Vector3d axes[] = {Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()};
  for (const Eigen::Vector3d& axis : axes) {
    RigidTransform pose = RigidTransform::Identity();
    pose.linear() = rotationFromVector({0.1, 0.15, 0.05}) *
                    Eigen::Quaterniond::FromTwoVectors(axis, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    pose.translation() = Eigen::Vector3d(0, 0, kDepthMm) - pose.linear() * engine->volume().centreCt();
    // Voxel boxes against interpolation on this blob differ by 3 % at most; a wrong stride, half or axis by far more.
    checkPicture(engine->device().name(), engine->render(camera, 0, pose), referenceProjection(volume, pose, camera, 2),
                 0.08);
  }
  engine->releaseVolume();
}

void warmUp(Engine* engine, Similarity similarity) {
  AttenuationVolume volume = blob();
  volume.face_is_cut.fill(true);
  engine->setVolume(volume);
  const XrayCamera camera{72, 64, 400.0, 400.0, 35.5, 31.5};  // Of two levels.
  RigidTransform pose = RigidTransform::Identity();
  pose.translation() = Eigen::Vector3d(0, 0, kDepthMm) - engine->volume().centreCt();
  const FloatImage drawn = engine->render(camera, 0, pose);
  const auto xray = engine->upload(camera, drawn, FloatImage(camera.width, camera.height, 1.0F));
  engine->weighUnexplained(xray.get(), pose, 1.0);
  const WindowOptions windows = windowsFor(similarity, xray->deviation());
  for (int level = 1; level >= 0; --level) {
    engine->evaluate(xray.get(), level, 0, {pose}, windows);
    engine->evaluate(xray.get(), level, 0, {pose, pose, pose}, windows);
  }
  engine->keepContrastTiles(xray.get(), 0, 0.5);
  engine->addUpTiles(xray.get(), 0, 0, camera, pose, {RayMotion()});
  const auto look = engine->share(xray.get());
  look->leaveOut({{0.0, 0.0, 8.0, 8.0}});
  engine->surround(look.get(), 0, 0, pose);
  engine->addUpBody(look.get(), 0, 0, pose);
  engine->releaseVolume();
}

}  // namespace xray_registration
