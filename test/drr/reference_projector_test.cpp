#include "xray_registration/drr/reference_projector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace xray_registration {
namespace {

constexpr double kMuPerMm = 0.02;

/// Not square, and different focal lengths along both axes.
XrayCamera camera() { return {40, 24, 400.0, 380.0, 19.0, 12.5}; }

VolumeGrid obliqueGrid(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm) {
  VolumeGrid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  grid.direction = rotationFromVector({0.3, -0.5, 0.8});
  grid.origin_ct_mm = {12.0, -7.0, 31.0};
  return grid;
}

AttenuationVolume filled(const VolumeGrid& grid) {
  AttenuationVolume volume;
  volume.grid = grid;
  volume.values.assign(grid.voxelCount(), 1000);
  volume.scale_per_mm = static_cast<float>(kMuPerMm / 1000.0);
  return volume;
}

/// A pose that puts the grid's centre on `centre_camera_mm`.
RigidTransform poseOf(const VolumeGrid& grid, const Eigen::Vector3d& centre_camera_mm) {
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() = rotationFromVector({-0.7, 0.2, 0.4});
  T_camera_ct.translation() = centre_camera_mm - T_camera_ct.linear() * grid.centreCt();
  return T_camera_ct;
}

/// Chord of the ray through a pixel with the grid's box, by the half-spaces of its faces in the camera frame.
double boxChordMm(const VolumeGrid& grid, const RigidTransform& T_camera_ct, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d direction = ray.normalized();
  const Eigen::Vector3d centre = T_camera_ct * grid.centreCt();
  double enter = 0.0;
  double leave = 1e9;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d normal = T_camera_ct.linear() * grid.direction.col(axis);
    const double half_mm = 0.5 * grid.size[axis] * grid.spacing_mm[axis];
    const double a = (normal.dot(centre) - half_mm) / normal.dot(direction);
    const double b = (normal.dot(centre) + half_mm) / normal.dot(direction);
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return std::max(0.0, leave - enter);
}

void expectBoxImage(const VolumeGrid& grid, const RigidTransform& T_camera_ct) {
  const FloatImage image = referenceProjection(filled(grid), T_camera_ct, camera());
  ASSERT_EQ(image.width, camera().width);
  ASSERT_EQ(image.height, camera().height);
  double largest = 0.0;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const double expected = kMuPerMm * boxChordMm(grid, T_camera_ct, camera().rayDirection(u, v));
      // Both are exact; what remains is the float of the image and of scale_per_mm, 1e-7 of a value of a few units.
      ASSERT_NEAR(image.at(u, v), expected, 1e-6) << "pixel " << u << ", " << v;
      largest = std::max(largest, expected);
    }
  }
  EXPECT_GT(largest, 0.2) << "the box must be in the image for this test to mean anything";
}

TEST(ReferenceProjector, ObliqueAnisotropicBoxIsExact) {
  const VolumeGrid grid = obliqueGrid({17, 9, 23}, {1.5, 4.0, 0.7});
  expectBoxImage(grid, poseOf(grid, {1.0, -2.0, 500.0}));
}

TEST(ReferenceProjector, SourceInsideTheVolumeSeesWhatLiesAhead) {
  const VolumeGrid grid = obliqueGrid({20, 20, 20}, {3.0, 4.0, 5.0});
  expectBoxImage(grid, poseOf(grid, {3.0, 2.0, 8.0}));
}

TEST(ReferenceProjector, WhatLiesBehindTheSourceIsNotSeen) {
  const VolumeGrid grid = obliqueGrid({20, 20, 20}, {3.0, 4.0, 5.0});
  const FloatImage image = referenceProjection(filled(grid), poseOf(grid, {0.0, 0.0, -300.0}), camera());
  for (const float value : image.pixels) ASSERT_EQ(value, 0.0F);
}

TEST(ReferenceProjector, RaysThatMissAreZero) {
  const VolumeGrid grid = obliqueGrid({5, 5, 5}, {1.0, 1.0, 1.0});
  const RigidTransform T_camera_ct = poseOf(grid, {0.0, 0.0, 500.0});
  // 5 mm at 500 mm are 4 pixels: the corners are far outside.
  EXPECT_EQ(referenceLineIntegral(filled(grid), T_camera_ct, camera(), 0, 0), 0.0);
  EXPECT_GT(referenceLineIntegral(filled(grid), T_camera_ct, camera(), 19.0, 12.5), 0.0);
}

TEST(ReferenceProjector, RaysAlongAnAxisAndInVoxelFacesAreExact) {
  VolumeGrid grid;
  grid.size = {4, 4, 10};
  grid.spacing_mm = {1.0, 1.0, 2.0};
  grid.origin_ct_mm = {-1.5, -1.5, 100.0};
  // The ray through the principal point runs in the faces between the middle voxels, straight along z: 10 · 2 mm.
  // The float of scale_per_mm is the only rounding, 6e-8 relative.
  EXPECT_NEAR(referenceLineIntegral(filled(grid), RigidTransform::Identity(), camera(), 19.0, 12.5), 20.0 * kMuPerMm,
              1e-7);
}

TEST(ReferenceProjector, EveryVoxelCountsWithItsOwnLength) {
  VolumeGrid grid;
  grid.size = {1, 1, 4};
  grid.spacing_mm = {10.0, 10.0, 3.0};
  grid.origin_ct_mm = {0.0, 0.0, 200.0};
  AttenuationVolume volume = filled(grid);
  volume.values = {1, 20, 300, 4000};
  volume.scale_per_mm = 0.001F;
  const double u = camera().cx + 4.0;  // Tilted in x: every length grows by the same factor.
  const double lengthening = std::sqrt(1.0 + 0.01 * 0.01);
  // The float of scale_per_mm rounds by up to 6e-8 relative.
  EXPECT_NEAR(referenceLineIntegral(volume, RigidTransform::Identity(), camera(), u, 12.5), 4.321 * 3.0 * lengthening,
              1e-6);
}

TEST(ReferenceProjector, FinelyPaintedEllipsoidMeetsTheFormula) {
  VolumeGrid grid = obliqueGrid({80, 80, 80}, {0.6, 0.5, 0.4});
  const Eigen::Vector3d semi_axes_mm(20.0, 16.0, 12.0);  // Along the grid's axes.
  AttenuationVolume volume = filled(grid);
  const auto inside = [&](int x, int y, int z) {
    const Eigen::Vector3d offset =
        (Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Constant(39.5)).cwiseProduct(grid.spacing_mm);
    return offset.cwiseQuotient(semi_axes_mm).squaredNorm() <= 1.0;
  };
  std::size_t i = 0;
  for (int z = 0; z < 80; ++z)
    for (int y = 0; y < 80; ++y)
      for (int x = 0; x < 80; ++x) volume.values[i++] = inside(x, y, z) ? 1000 : 0;

  const RigidTransform T_camera_ct = poseOf(grid, {0.0, 0.0, 400.0});
  const FloatImage image = referenceProjection(volume, T_camera_ct, camera());
  const Eigen::Matrix3d scaled_from_camera =
      semi_axes_mm.cwiseInverse().asDiagonal() * (T_camera_ct.linear() * grid.direction).transpose();
  const Eigen::Vector3d o = scaled_from_camera * (-(T_camera_ct * grid.centreCt()));
  double sum_of_squares = 0.0;
  int count = 0;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const Eigen::Vector3d ray = camera().rayDirection(u, v).normalized();
      const Eigen::Vector3d d = scaled_from_camera * ray;
      const double root = o.dot(d) * o.dot(d) - d.squaredNorm() * (o.squaredNorm() - 1.0);
      const double expected = root > 0.0 ? 2.0 * kMuPerMm * std::sqrt(root) / d.squaredNorm() : 0.0;
      // A ray enters and leaves through stairs of one voxel: up to a voxel diagonal (0.9 mm) at each end, and more
      // where it is tangent, which the root mean square below bounds.
      if (expected > 0.4) {
        ASSERT_NEAR(image.at(u, v), expected, 2 * 0.9 * kMuPerMm);
      }
      sum_of_squares += std::pow(image.at(u, v) - expected, 2);
      ++count;
    }
  }
  // Stairs are uniform within about ±0.3 mm: 0.2 mm rms at two ends; three times that for tangent rays.
  EXPECT_LT(std::sqrt(sum_of_squares / count), 0.6 * kMuPerMm);
}

TEST(ReferenceProjector, SamplesInsideThePixelAreAveraged) {
  const VolumeGrid grid = obliqueGrid({5, 5, 5}, {1.0, 1.0, 1.0});
  const AttenuationVolume volume = filled(grid);
  const RigidTransform T_camera_ct = poseOf(grid, {0.0, 0.0, 500.0});
  const FloatImage image = referenceProjection(volume, T_camera_ct, camera(), 2);
  double expected = 0.0;
  for (const double du : {-0.25, 0.25})
    for (const double dv : {-0.25, 0.25})
      expected += 0.25 * referenceLineIntegral(volume, T_camera_ct, camera(), 20 + du, 14 + dv);
  EXPECT_FLOAT_EQ(image.at(20, 14), static_cast<float>(expected));
  EXPECT_NE(image.at(20, 14), referenceProjection(volume, T_camera_ct, camera(), 1).at(20, 14));
}

TEST(ReferenceProjector, RefusesWhatItCannotRender) {
  const VolumeGrid grid = obliqueGrid({5, 5, 5}, {1.0, 1.0, 1.0});
  AttenuationVolume volume = filled(grid);
  XrayCamera uncalibrated = camera();
  uncalibrated.fx = 0.0;
  EXPECT_THROW(referenceProjection(volume, RigidTransform::Identity(), uncalibrated), std::invalid_argument);
  EXPECT_THROW(referenceProjection(volume, RigidTransform::Identity(), camera(), 0), std::invalid_argument);
  volume.values.pop_back();
  EXPECT_THROW(referenceProjection(volume, RigidTransform::Identity(), camera()), std::invalid_argument);
}

TEST(ReferenceProjector, NoVoxelsGiveAnEmptyPicture) {
  const FloatImage image = referenceProjection(AttenuationVolume{}, RigidTransform::Identity(), camera());
  ASSERT_EQ(image.pixels.size(), 40u * 24u);
  for (const float value : image.pixels) ASSERT_EQ(value, 0.0F);
}

}  // namespace
}  // namespace xray_registration
