#include "xray_registration/image/landmark_place.h"

#include <gtest/gtest.h>

#include <limits>

namespace xray_registration {
namespace {

/// A box from (-200, 10, 0) to (0, 210, 100), its voxels' edges.
VolumeGrid grid() {
  VolumeGrid grid;
  grid.size = {100, 100, 50};
  grid.spacing_mm = {2, 2, 2};
  grid.origin_ct_mm = {-199, 11, 1};
  return grid;
}

Landmark at(const Eigen::Vector3d& point, const std::string& name = "") { return {name, point, {0, 0}, 0}; }

TEST(LandmarkPlace, TakesPointsInTheCtAndOnItsRim) {
  EXPECT_EQ(outsideOfCt({}, grid()), "");
  EXPECT_EQ(outsideOfCt({at({-100, 100, 50}), at({9, 100, 50}), at({-100, 100, -9})}, grid()), "");
}

TEST(LandmarkPlace, NamesAPointOutside) {
  const std::string problem = outsideOfCt({at({-100, 100, 50}), at({-100, 100, 111}, "chin")}, grid());
  EXPECT_NE(problem.find("'chin' lies outside of the CT"), std::string::npos) << problem;
  EXPECT_EQ(problem.find("RAS"), std::string::npos) << problem;
}

TEST(LandmarkPlace, SaysWhenPointsWereMeantAsRas) {
  const std::string problem = outsideOfCt({at({100, -100, 50}), at({50, -20, 20})}, grid());
  EXPECT_NE(problem.find("RAS"), std::string::npos) << problem;
}

TEST(LandmarkPlace, SaysWhenMillimetresWereGivenForMetres) {
  const std::string problem = outsideOfCt({at({-100e3, 100e3, 50e3}), at({-50e3, 20e3, 20e3})}, grid());
  EXPECT_NE(problem.find("mm for metres"), std::string::npos) << problem;
}

TEST(LandmarkPlace, LeavesNumbersThatAreNoneToOthers) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(outsideOfCt({at({nan, 100, 50})}, grid()), "");
}

}  // namespace
}  // namespace xray_registration
