#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <string>

#include "../volume/test_meshes.h"
#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/volume/surface_mesh.h"

// Line integrals through voxelised meshes against those of the shapes.

namespace xray_registration {
namespace {

constexpr double kAttenuation = 0.25;
constexpr double kSpacing = 0.5;

const XrayCamera kCamera{200, 200, 1000.0, 1000.0, 99.5, 99.5};

// The object 800 mm from the source, seen along a direction that is no axis of its grid.
RigidTransform viewPose() {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector({0.3, -0.5, 0.9});
  pose.translation() = Eigen::Vector3d(2.0, -3.0, 800.0);
  return pose;
}

// Length of the line p + t d inside a ball at the origin, d of length 1.
double chord(const Eigen::Vector3d& p, const Eigen::Vector3d& d, double radius) {
  const double squared = radius * radius - (p - p.dot(d) * d).squaredNorm();
  return squared > 0.0 ? 2.0 * std::sqrt(squared) : 0.0;
}

// Length inside a box by slabs.
double boxLength(const Eigen::Vector3d& p, const Eigen::Vector3d& d, const Eigen::Vector3d& half) {
  const Eigen::Array3d a = (-half - p).array() / d.array();
  const Eigen::Array3d b = (half - p).array() / d.array();
  return std::max(0.0, a.max(b).minCoeff() - a.min(b).maxCoeff());
}

// The solid's volume as the mesh's triangles give it (divergence theorem), mm³.
double volumeOf(const SurfaceMesh& mesh) {
  double volume = 0.0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.points_mm[t[0]].cast<double>();
    const Eigen::Vector3d b = mesh.points_mm[t[1]].cast<double>();
    volume += a.dot(b.cross(mesh.points_mm[t[2]].cast<double>())) / 6.0;
  }
  return volume;
}

template <typename Length>
void compare(const SurfaceMesh& mesh, const Length& length, double allowed_mean_mm, double allowed_largest_mm) {
  const AttenuationVolume volume = voxelise(mesh, kAttenuation, kSpacing);
  const RigidTransform pose = viewPose();
  const RigidTransform inverse = pose.inverse();
  double sum = 0.0;
  double bias = 0.0;
  double largest = 0.0;
  int rays = 0;
  for (int v = 60; v < 140; v += 2) {
    for (int u = 60; u < 140; u += 2) {
      const double expected = length(inverse.translation(), inverse.linear() * kCamera.rayDirection(u, v).normalized());
      const double found = referenceLineIntegral(volume, pose, kCamera, u, v) / kAttenuation;
      const double error = found - expected;
      if (expected <= 0.0 && found <= 0.0) continue;
      ++rays;
      sum += std::abs(error);
      bias += error;
      largest = std::max(largest, std::abs(error));
    }
  }
  ASSERT_GT(rays, 300);
  EXPECT_LT(sum / rays, allowed_mean_mm);
  // What falls into a pixel: the mean over rays is right to some hundredths of a voxel.
  EXPECT_LT(std::abs(bias / rays), 0.05 * kSpacing) << bias / rays;
  EXPECT_LT(largest, allowed_largest_mm);
}

// A ray meets a border voxel over a length that only on average fits the share of it that is solid, hence a third of a
// voxel on single rays. Tangent rays are off by more: a chord changes by sqrt(8 r h) when the ray is h further out
// (4.5 mm for a quarter of a voxel).
TEST(MeshProjection, ASphere) {
  const SurfaceMesh mesh = test_meshes::sphere(Eigen::Vector3d::Zero(), 20.0);
  // The facets lie a little inside the ball.
  const double radius = std::cbrt(volumeOf(mesh) / (4.0 / 3.0 * M_PI));
  compare(
      mesh, [radius](const Eigen::Vector3d& p, const Eigen::Vector3d& d) { return chord(p, d, radius); },
      0.4 * kSpacing, 4.5);
}

TEST(MeshProjection, ABox) {
  const Eigen::Vector3d half(15.3, 9.9, 12.1);
  compare(
      test_meshes::box(-half, half),
      [&half](const Eigen::Vector3d& p, const Eigen::Vector3d& d) { return boxLength(p, d, half); }, 0.4 * kSpacing,
      4.5);
}

TEST(MeshProjection, RealKneeImplants) {
  const char* data = std::getenv("XRAY_REGISTRATION_DATA");
  if (data == nullptr) GTEST_SKIP() << "XRAY_REGISTRATION_DATA names no data";
  for (const char* name : {"femur.stl", "tibia.stl"}) {
    const std::string path = std::string(data) + "/knee_implants/" + name;
    const SurfaceMesh mesh = readMesh(path);
    const AttenuationVolume volume = voxelise(mesh, kAttenuation, 0.0, path);
    EXPECT_GT(volume.grid.spacing_mm.x(), 0.2) << name;
    EXPECT_LT(volume.grid.spacing_mm.x(), 0.7) << name;
    double sum = 0.0;
    for (const std::uint16_t value : volume.values) sum += value / 65535.0;
    sum *= volume.grid.spacing_mm.prod();
    // Parts of the tibia's surface overlap, which the triangles count twice.
    EXPECT_NEAR(sum, std::abs(volumeOf(mesh)), 0.01 * std::abs(volumeOf(mesh))) << name;
  }
}

}  // namespace
}  // namespace xray_registration
