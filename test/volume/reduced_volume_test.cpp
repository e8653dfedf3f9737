#include "xray_registration/volume/reduced_volume.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(ReducedForDisplay, KeepsItsPlace) {
  Volume ct;
  ct.grid.size = {41, 40, 30};
  ct.grid.spacing_mm = {1.0, 2.0, 3.0};
  ct.grid.origin_ct_mm = {10.0, 20.0, 30.0};
  for (int z = 0; z < 30; ++z) {
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 41; ++x) ct.hu.push_back(static_cast<std::int16_t>(10 * x + 100 * (y / 10)));
    }
  }
  const Volume reduced = reducedForDisplay(ct, 8000);
  EXPECT_LE(reduced.grid.voxelCount(), 8000U);
  EXPECT_EQ(reduced.hu.size(), reduced.grid.voxelCount());
  const double factor = reduced.grid.spacing_mm.x();
  // HU rises by 10 per voxel of 1 mm along x, so a block's mean is the value at its centre.
  const double x_ct = (reduced.grid.ctFromIndex() * Eigen::Vector3d(3, 0, 0)).x();
  EXPECT_NEAR(reduced.hu[3], 10.0 * (x_ct - 10.0), 1.0);  // Rounded to whole HU.
  EXPECT_GE(factor, 2.0);
  EXPECT_EQ(reducedForDisplay(ct, 1000000).hu, ct.hu);
}

}  // namespace
}  // namespace xray_registration
