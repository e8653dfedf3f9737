#include "xray_registration/volume/bone_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

VolumeGrid obliqueGrid() {
  VolumeGrid grid;
  grid.size = {60, 50, 40};
  grid.spacing_mm = {1.0, 1.2, 1.5};
  grid.direction = Eigen::AngleAxisd(0.6, Eigen::Vector3d(1.0, 1.0, -0.3).normalized()).toRotationMatrix();
  grid.origin_ct_mm = {50.0, -200.0, 600.0};
  return grid;
}

Volume ball(const VolumeGrid& grid, double radius_mm) {
  const PhantomEllipsoid shape{grid.centreCt(), Eigen::Vector3d::Constant(radius_mm), Eigen::Matrix3d::Identity(),
                               1000};
  return paintPhantom(grid, {shape}, 4);
}

double signedVolume(const TriangleMesh& mesh, const Eigen::Vector3d& centre) {
  double volume = 0.0;
  for (const auto& triangle : mesh.triangles) {
    const auto corner = [&](std::size_t i) {
      return (mesh.vertices_ct_mm[static_cast<std::size_t>(triangle[i])].cast<double>() - centre).eval();
    };
    volume += corner(0).dot(corner(1).cross(corner(2))) / 6.0;
  }
  return volume;
}

TEST(BoneSurface, ABallLiesWhereItIsInTheCtFrame) {
  const VolumeGrid grid = obliqueGrid();
  const TriangleMesh mesh = boneSurface(ball(grid, 18.0), 0.0, 100000);
  ASSERT_GT(mesh.triangles.size(), 1000U);
  for (const Eigen::Vector3f& vertex : mesh.vertices_ct_mm) {
    // Linear interpolation between voxels of up to 1.5 mm that are filled in part.
    EXPECT_NEAR((vertex.cast<double>() - grid.centreCt()).norm(), 18.0, 0.35);
  }
  // The ball's volume, from triangles that all face outwards.
  EXPECT_NEAR(signedVolume(mesh, grid.centreCt()) / (4.0 / 3.0 * 3.14159265 * 18.0 * 18.0 * 18.0), 1.0, 0.02);
}

TEST(BoneSurface, FacesOutwardsOnALeftHandedGridToo) {
  VolumeGrid grid = obliqueGrid();
  grid.direction.col(1) *= -1.0;
  EXPECT_GT(signedVolume(boneSurface(ball(grid, 18.0), 0.0, 100000), grid.centreCt()), 0.0);
}

TEST(BoneSurface, IsClosedAndItsIndicesAreValid) {
  const TriangleMesh mesh = boneSurface(ball(obliqueGrid(), 100.0), 0.0, 100000);  // Larger than the volume.
  std::map<std::pair<int, int>, int> edges;
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_GE(triangle[i], 0);
      ASSERT_LT(triangle[i], static_cast<int>(mesh.vertices_ct_mm.size()));
      const auto edge = std::minmax(triangle[i], triangle[(i + 1) % 3]);
      ++edges[edge];
    }
  }
  ASSERT_FALSE(edges.empty());
  for (const auto& edge : edges) EXPECT_EQ(edge.second, 2);
}

TEST(BoneSurface, DecimatesToTheLimit) {
  const Volume head = headPhantom(2.0);
  for (const std::size_t limit : {std::size_t{3000}, std::size_t{10000}, std::size_t{40000}}) {
    const TriangleMesh mesh = boneSurface(head, 250.0, limit);
    EXPECT_LE(mesh.triangles.size(), limit);
    EXPECT_GT(mesh.triangles.size(), limit / 4);
    for (const Eigen::Vector3f& vertex : mesh.vertices_ct_mm) ASSERT_TRUE(vertex.allFinite());
  }
}

TEST(BoneSurface, NoBoneNoSurface) {
  const Volume volume = ball(obliqueGrid(), 18.0);
  EXPECT_TRUE(boneSurface(volume, 2000.0, 1000).triangles.empty());
  EXPECT_TRUE(boneSurface(volume, 0.0, 0).triangles.empty());
  EXPECT_TRUE(boneSurface(Volume{}, 0.0, 1000).triangles.empty());
}

}  // namespace
}  // namespace xray_registration
