#include "xray_registration/geometry/volume_grid.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

VolumeGrid obliqueGrid() {
  VolumeGrid grid;
  grid.size = {10, 20, 30};
  grid.spacing_mm = {1.0, 2.0, 3.0};
  grid.origin_ct_mm = {-5.0, 7.0, 100.0};
  grid.direction = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 1, 0).normalized()).toRotationMatrix();
  return grid;
}

TEST(VolumeGrid, OriginIsTheCentreOfTheFirstVoxel) {
  const VolumeGrid grid = obliqueGrid();
  EXPECT_LT((grid.ctFromIndex() * Eigen::Vector3d::Zero() - grid.origin_ct_mm).norm(), 1e-12);
  EXPECT_LT((grid.ctFromIndex() * Eigen::Vector3d(0, 1, 0) - grid.origin_ct_mm - 2.0 * grid.direction.col(1)).norm(),
            1e-12);
}

TEST(VolumeGrid, CornersEncloseVoxelsNotCentres) {
  const VolumeGrid grid = obliqueGrid();
  const auto corners = grid.cornersCt();
  EXPECT_NEAR((corners[0] - corners[1]).norm(), 10.0, 1e-12);
  EXPECT_NEAR((corners[0] - corners[2]).norm(), 40.0, 1e-12);
  EXPECT_NEAR((corners[0] - corners[4]).norm(), 90.0, 1e-12);
  EXPECT_LT((0.5 * (corners[0] + corners[7]) - grid.centreCt()).norm(), 1e-12);
}

TEST(VolumeGrid, SameAsSeesAShiftAndATurn) {
  VolumeGrid other = obliqueGrid();
  EXPECT_TRUE(other.sameAs(obliqueGrid()));
  other.origin_ct_mm.x() += 0.1;
  EXPECT_FALSE(other.sameAs(obliqueGrid()));
}

}  // namespace
}  // namespace xray_registration
