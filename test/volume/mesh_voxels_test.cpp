#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "test_meshes.h"
#include "xray_registration/volume/surface_mesh.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

using namespace test_meshes;

double solidMm3(const AttenuationVolume& volume, double attenuation_per_mm) {
  double sum = 0.0;
  for (const std::uint16_t value : volume.values) sum += value;
  return sum * volume.scale_per_mm / attenuation_per_mm * volume.grid.spacing_mm.prod();
}

double valueAt(const AttenuationVolume& volume, const Eigen::Vector3d& point) {
  const Eigen::Vector3i i = (volume.grid.ctFromIndex().inverse() * point).array().round().cast<int>();
  if ((i.array() < 0).any() || (i.array() >= volume.grid.size.array()).any()) return 0.0;
  return volume
             .values[(static_cast<std::size_t>(i.z()) * volume.grid.size.y() + i.y()) * volume.grid.size.x() + i.x()] *
         static_cast<double>(volume.scale_per_mm);
}

std::string messageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const VolumeError& error) {
    return error.what();
  }
  return "no VolumeError";
}

constexpr double kBall = 4.0 / 3.0 * M_PI;

TEST(Voxelise, ABoxThatEndsBetweenVoxelsKeepsItsVolume) {
  const Eigen::Vector3d low(1.3, -7.2, 100.1);
  const Eigen::Vector3d high(12.77, 3.11, 109.0);
  const AttenuationVolume volume = voxelise(box(low, high), 0.3, 0.5);
  // Exact along x; a quarter of a voxel's line along y and z, at two ends of some 20 voxels.
  EXPECT_NEAR(solidMm3(volume, 0.3), (high - low).prod(), 0.01 * (high - low).prod());
  EXPECT_NEAR(valueAt(volume, 0.5 * (low + high)), 0.3, 1e-5);
  EXPECT_EQ(valueAt(volume, low - Eigen::Vector3d::Constant(0.6)), 0.0);
  EXPECT_EQ(volume.face_is_cut, (std::array<bool, 6>{}));
}

TEST(Voxelise, ASphereAndATorusHaveTheirVolumes) {
  const AttenuationVolume ball = voxelise(sphere({5.0, 6.0, -7.0}, 10.0), 0.2, 0.5);
  // The mesh's chords take 0.2 % away.
  EXPECT_NEAR(solidMm3(ball, 0.2), kBall * 1000.0, 0.004 * kBall * 1000.0);
  const AttenuationVolume ring = voxelise(torus({0.0, 3.0, 1.0}, 15.0, 4.0), 0.2, 0.5);
  const double expected = 2.0 * M_PI * M_PI * 15.0 * 16.0;
  EXPECT_NEAR(solidMm3(ring, 0.2), expected, 0.005 * expected);
  EXPECT_EQ(valueAt(ring, {0.0, 3.0, 1.0}), 0.0);  // The hole.
  EXPECT_NEAR(valueAt(ring, {15.0, 3.0, 1.0}), 0.2, 1e-5);
}

TEST(Voxelise, PointsOnLinesOfTheGridDoNoHarm) {
  // Voxels of 1 mm in a box of whole millimetres: its planes, edges and corners lie on lines that sample a voxel when
  // it is moved by 1/8 mm, and a slanted square's corners do.
  for (const double shift : {0.0, 0.125, 0.25, 0.375, 0.5}) {
    const Eigen::Vector3d low = Eigen::Vector3d::Constant(shift);
    const AttenuationVolume volume = voxelise(box(low, low + Eigen::Vector3d::Constant(8.0)), 1.0, 1.0);
    EXPECT_NEAR(solidMm3(volume, 1.0), 512.0, 1e-2) << shift;
    SurfaceMesh diamond = box(low, low + Eigen::Vector3d::Constant(8.0));
    for (Eigen::Vector3f& p : diamond.points_mm) p = Eigen::Vector3f(p.x(), p.y() - p.z(), p.y() + p.z());
    EXPECT_NEAR(solidMm3(voxelise(diamond, 1.0, 1.0), 1.0), 1024.0, 0.02 * 1024.0) << shift;
  }
}

TEST(Voxelise, DuplicatesFlippedNormalsAndUnmergedPointsChangeNothing) {
  const SurfaceMesh clean = torus({0.0, 0.0, 0.0}, 12.0, 4.0);
  const AttenuationVolume expected = voxelise(clean, 0.2, 0.6);
  SurfaceMesh some_flipped = clean;
  for (std::size_t i = 0; i < some_flipped.triangles.size(); i += 3) {
    std::swap(some_flipped.triangles[i][0], some_flipped.triangles[i][1]);
  }
  SurfaceMesh repeated = clean;
  for (std::size_t i = 0; i < clean.triangles.size(); i += 2) {
    auto triangle = clean.triangles[i];
    std::rotate(triangle.begin(), triangle.begin() + 1, triangle.end());
    repeated.triangles.push_back(triangle);
  }
  SurfaceMesh degenerate = clean;
  degenerate.triangles.push_back({7, 7, 9});
  SurfaceMesh soup;
  for (const auto& triangle : clean.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.points_mm.size());
    for (const std::uint32_t corner : triangle) soup.points_mm.push_back(clean.points_mm[corner]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const SurfaceMesh cases[] = {some_flipped, flipped(clean), repeated, degenerate, soup, joined(clean, flipped(clean))};
  for (const SurfaceMesh& mesh : cases) EXPECT_EQ(voxelise(mesh, 0.2, 0.6).values, expected.values);
}

TEST(Voxelise, AFoldWithoutThicknessBoundsNothing) {
  const SurfaceMesh clean = box({0.0, 0.0, 0.0}, {8.0, 8.0, 8.0});
  SurfaceMesh folded = clean;
  const auto first = static_cast<std::uint32_t>(folded.points_mm.size());
  for (const Eigen::Vector3f& p : {Eigen::Vector3f(3, 3, 3), Eigen::Vector3f(5, 3, 3), Eigen::Vector3f(3, 5, 3)}) {
    folded.points_mm.push_back(p);
  }
  folded.triangles.push_back({first, first + 1, first + 2});
  folded.triangles.push_back({first, first + 2, first + 1});
  EXPECT_EQ(voxelise(folded, 0.2, 0.6).values, voxelise(clean, 0.2, 0.6).values);
}

TEST(Voxelise, OverlappingShellsAreOneSolidAndInnerOnesCavities) {
  const SurfaceMesh a = box({0.0, 0.0, 0.0}, {10.0, 10.0, 10.0});
  const SurfaceMesh b = box({5.0, 5.0, 5.0}, {15.0, 15.0, 15.0});
  EXPECT_NEAR(solidMm3(voxelise(joined(a, b), 1.0, 0.5), 1.0), 2000.0 - 125.0, 1.0);
  const SurfaceMesh hollow = joined(a, flipped(box({2.5, 2.5, 2.5}, {7.5, 7.5, 7.5})));
  EXPECT_NEAR(solidMm3(voxelise(hollow, 1.0, 0.5), 1.0), 1000.0 - 125.0, 1.0);
}

TEST(Voxelise, TheSpacingFollowsSizeAndThickness) {
  // A knee implant's size.
  EXPECT_NEAR(voxelise(box({0.0, 0.0, 0.0}, {70.0, 60.0, 50.0}), 0.25).grid.spacing_mm.x(), 0.5, 0.05);
  const AttenuationVolume rod = voxelise(box({0.0, 0.0, 0.0}, {400.0, 4.0, 4.0}), 0.25);
  EXPECT_LT(rod.grid.spacing_mm.x(), 0.4);
  EXPECT_LE(rod.grid.voxelCount(), 40000000U);
  // Thin and large all around: as fine as 40 M voxels allow.
  const AttenuationVolume ring = voxelise(torus({0.0, 0.0, 0.0}, 200.0, 1.0), 0.25);
  EXPECT_LE(ring.grid.voxelCount(), 40000000U);
  EXPECT_EQ(voxelise(box({0.0, 0.0, 0.0}, {9.0, 9.0, 9.0}), 0.25, 0.7).grid.spacing_mm.x(), 0.7);
}

TEST(Voxelise, RefusesByNameWithTheReason) {
  const SurfaceMesh good = box({0.0, 0.0, 0.0}, {10.0, 10.0, 10.0});
  const auto said = [](const SurfaceMesh& mesh, double attenuation = 0.25, double spacing = 0.0) {
    return messageOf([&] { voxelise(mesh, attenuation, spacing, "implant.stl"); });
  };
  SurfaceMesh open = good;
  open.triangles.pop_back();
  EXPECT_NE(said(open).find("'implant.stl': its surface is not closed"), std::string::npos);
  EXPECT_NE(said(open).find("3 edges lack a neighbour"), std::string::npos);
  EXPECT_NE(said(SurfaceMesh{}).find("no triangles"), std::string::npos);
  SurfaceMesh metres = good;
  for (Eigen::Vector3f& point : metres.points_mm) point *= 0.001F;
  EXPECT_NE(said(metres).find("scale it by 1000"), std::string::npos);
  SurfaceMesh huge = good;
  for (Eigen::Vector3f& point : huge.points_mm) point *= 1000.0F;
  EXPECT_NE(said(huge).find("shorter than 1 m"), std::string::npos);
  SurfaceMesh broken = good;
  broken.points_mm[2].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(said(broken).find("no finite number"), std::string::npos);
  broken = good;
  broken.triangles[0][1] = 99;
  EXPECT_NE(said(broken).find("not there"), std::string::npos);
  for (const double attenuation : {0.0, -1.0, 1e3, std::nan("")}) {
    EXPECT_NE(said(good, attenuation).find("attenuation"), std::string::npos);
  }
  EXPECT_NE(said(good, 0.25, -0.5).find("voxel size"), std::string::npos);
  EXPECT_NE(said(good, 0.25, 0.01).find("40 million"), std::string::npos);
}

}  // namespace
}  // namespace xray_registration
