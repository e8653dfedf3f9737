#include "xray_registration/volume/phantom.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "xray_registration/volume/attenuation.h"

namespace xray_registration {
namespace {

std::int16_t at(const Volume& volume, int x, int y, int z) {
  return volume.hu[(static_cast<std::size_t>(z) * volume.grid.size.y() + y) * volume.grid.size.x() + x];
}

TEST(WhiteCube, SameCubeAtEveryResolution) {
  for (const int n : {16, 30, 32, 64}) {
    const Volume cube = whiteCube(n, 80.0);
    ASSERT_EQ(cube.grid.size, Eigen::Vector3i::Constant(n));
    EXPECT_NEAR((cube.grid.size.cast<double>().cwiseProduct(cube.grid.spacing_mm)).x(), 80.0, 1e-9);
    EXPECT_LT(cube.grid.centreCt().norm(), 1e-9);
    double filled = 0.0;
    for (const std::int16_t hu : cube.hu) filled += (hu + 1000) / 1000.0;
    // A half in each axis; voxels that are filled in part are rounded to whole HU.
    EXPECT_NEAR(filled * cube.grid.spacing_mm.prod(), 40.0 * 40.0 * 40.0, 1.0);
    EXPECT_EQ(at(cube, n / 2, n / 2, n / 2), 0);
    EXPECT_EQ(at(cube, 0, n / 2, n / 2), -1000);
  }
}

TEST(WhiteCube, RefusesSizesThatMakeNoSense) {
  EXPECT_THROW(whiteCube(0), std::invalid_argument);
  EXPECT_THROW(whiteCube(5000), std::invalid_argument);
  EXPECT_THROW(whiteCube(16, 0.0), std::invalid_argument);
}

VolumeGrid obliqueGrid() {
  VolumeGrid grid;
  grid.size = {50, 40, 30};
  grid.spacing_mm = {1.0, 1.2, 1.7};
  grid.direction = Eigen::AngleAxisd(0.6, Eigen::Vector3d(1.0, 1.0, -0.3).normalized()).toRotationMatrix();
  grid.origin_ct_mm = {5.0, -20.0, 60.0};
  return grid;
}

TEST(Paint, AnEllipsoidHasItsVolumeAndPlaceOnAnObliqueGrid) {
  const VolumeGrid grid = obliqueGrid();
  PhantomEllipsoid shape;
  shape.centre_ct_mm = grid.centreCt() + Eigen::Vector3d(1.0, -2.0, 0.7);
  shape.semi_axes_mm = {17.0, 9.0, 12.0};
  shape.rotation = Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitY()).toRotationMatrix();
  shape.hu = 0.0;
  const Volume volume = paintPhantom(grid, {shape}, 3);
  double filled = 0.0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (int z = 0; z < 30; ++z) {
    for (int y = 0; y < 40; ++y) {
      for (int x = 0; x < 50; ++x) {
        const double share = (at(volume, x, y, z) + 1000) / 1000.0;
        filled += share;
        centre += share * (grid.ctFromIndex() * Eigen::Vector3d(x, y, z));
      }
    }
  }
  const double expected_mm3 = 4.0 / 3.0 * 3.14159265358979 * shape.semi_axes_mm.prod();
  // Sampling at 27 points a voxel: errors at the surface average out to well below a percent.
  EXPECT_NEAR(filled * grid.spacing_mm.prod() / expected_mm3, 1.0, 0.005);
  EXPECT_LT((centre / filled - shape.centre_ct_mm).norm(), 0.02);
}

TEST(Paint, LaterShapesReplaceEarlierOnes) {
  const VolumeGrid grid = obliqueGrid();
  const PhantomEllipsoid outer{grid.centreCt(), {15, 15, 15}, Eigen::Matrix3d::Identity(), 700.0};
  const PhantomEllipsoid inner{grid.centreCt(), {8, 8, 8}, Eigen::Matrix3d::Identity(), 30.0};
  EXPECT_EQ(at(paintPhantom(grid, {outer, inner}), 25, 20, 15), 30);
  EXPECT_EQ(at(paintPhantom(grid, {inner, outer}), 25, 20, 15), 700);
  EXPECT_EQ(at(paintPhantom(grid, {}), 25, 20, 15), -1000);
}

TEST(Paint, RefusesNonsense) {
  EXPECT_THROW(paintPhantom(VolumeGrid{}, {}), std::invalid_argument);
  const PhantomEllipsoid flat{Eigen::Vector3d::Zero(), {1, 0, 1}, Eigen::Matrix3d::Identity(), 0.0};
  EXPECT_THROW(paintPhantom(obliqueGrid(), {flat}), std::invalid_argument);
}

// Share of voxels whose HU lies in [low, high].
double shareOf(const Volume& volume, int low, int high) {
  const auto count = std::count_if(volume.hu.begin(), volume.hu.end(), [=](int hu) { return hu >= low && hu <= high; });
  return static_cast<double>(count) / static_cast<double>(volume.hu.size());
}

// Correlation of a volume with itself when index axis `axis` runs backwards: 1 when it is its own mirror image.
double mirrorCorrelation(const Volume& volume, int axis) {
  double xx = 0.0;
  double xy = 0.0;
  const Eigen::Vector3i n = volume.grid.size;
  for (int z = 0; z < n.z(); ++z) {
    for (int y = 0; y < n.y(); ++y) {
      for (int x = 0; x < n.x(); ++x) {
        Eigen::Vector3i other(x, y, z);
        other[axis] = n[axis] - 1 - other[axis];
        // Bone alone: the soft tissue's outline is nearly symmetric in people, too.
        const double a = std::max<int>(at(volume, x, y, z), 200) - 200;
        const double b = std::max<int>(at(volume, other.x(), other.y(), other.z()), 200) - 200;
        xx += a * a;
        xy += a * b;
      }
    }
  }
  return xy / xx;
}

TEST(HeadPhantom, IsAHeadAloneInItsVolume) {
  const Volume head = headPhantom(2.0);
  const Eigen::Vector3d extent = head.grid.size.cast<double>().cwiseProduct(head.grid.spacing_mm);
  EXPECT_LT((extent - Eigen::Vector3d(184, 224, 234)).cwiseAbs().maxCoeff(), 2.0);
  EXPECT_EQ(toAttenuation(head, {}).face_is_cut, (std::array<bool, 6>{}));
  EXPECT_GT(shareOf(head, -1000, -900), 0.3);
  EXPECT_GT(shareOf(head, -200, 100), 0.25);
  EXPECT_GT(shareOf(head, 300, 2000), 0.03);
  EXPECT_GT(shareOf(head, 2200, 4000), 0.0);  // The marker.
}

TEST(HeadPhantom, LeftAndRightDiffer) {
  const Volume head = headPhantom(2.0);
  // Nearly symmetric as heads are, so that the correlation is high, yet far from a mirror image of itself.
  EXPECT_LT(mirrorCorrelation(head, 0), 0.95);
  EXPECT_LT(mirrorCorrelation(head, 1), 0.8);
  EXPECT_LT(mirrorCorrelation(head, 2), 0.8);
}

TEST(HeadPhantom, TheSameAtEveryCallAndThePlaceAtEverySpacing) {
  EXPECT_EQ(headPhantom(4.0).hu, headPhantom(4.0).hu);
  const Eigen::Vector3d coarse = anatomicalCentreCt(toAttenuation(headPhantom(4.0), {}));
  const Eigen::Vector3d fine = anatomicalCentreCt(toAttenuation(headPhantom(2.0), {}));
  EXPECT_LT((coarse - fine).norm(), 4.0);  // The box of the tissue in whole voxels.
}

TEST(PelvisPhantom, GoesOnBeyondBothEnds) {
  const Volume pelvis = pelvisPhantom(3.0);
  const Eigen::Vector3d extent = pelvis.grid.size.cast<double>().cwiseProduct(pelvis.grid.spacing_mm);
  EXPECT_LT((extent - Eigen::Vector3d(360, 240, 260)).cwiseAbs().maxCoeff(), 3.0);
  EXPECT_EQ(toAttenuation(pelvis, {}).face_is_cut, (std::array<bool, 6>{false, false, false, false, true, true}));
  EXPECT_GT(shareOf(pelvis, 300, 2000), 0.01);
  EXPECT_LT(mirrorCorrelation(pelvis, 0), 0.9);
}

TEST(Phantoms, RefuseSpacingsThatMakeNoSense) {
  for (const double spacing : {0.0, -1.0, 0.01, 100.0, std::nan("")}) {
    EXPECT_THROW(headPhantom(spacing), std::invalid_argument);
    EXPECT_THROW(pelvisPhantom(spacing), std::invalid_argument);
  }
}

void expectBones(const LabelledPhantom& phantom, const Volume& plain, std::size_t bones) {
  // The CT is the one without labels.
  EXPECT_EQ(phantom.ct.hu, plain.hu);
  EXPECT_TRUE(phantom.labels.grid.sameAs(plain.grid));
  EXPECT_EQ(phantom.names.size(), bones);
  for (const auto& [name, label] : phantom.names) {
    std::size_t voxels = 0;
    double hu = 0.0;
    for (std::size_t i = 0; i < plain.hu.size(); ++i) {
      if (phantom.labels.labels[i] != label) continue;
      ++voxels;
      hu += plain.hu[i];
      ASSERT_GT(plain.hu[i], 100) << name;
    }
    // No bone is smaller than a cube of 12 mm, and all are denser than soft tissue.
    EXPECT_GT(static_cast<double>(voxels) * plain.grid.spacing_mm.prod(), 1700.0) << name;
    EXPECT_GT(hu / static_cast<double>(voxels), 200.0) << name;
  }
  for (const auto& [name, point] : phantom.joints_ct_mm) EXPECT_EQ(phantom.names.count(name), 1U) << name;
}

int labelAt(const LabelledPhantom& phantom, const Eigen::Vector3d& point_ct_mm) {
  const Eigen::Vector3i i =
      (phantom.labels.grid.ctFromIndex().inverse() * point_ct_mm).array().round().cast<int>().matrix();
  const Eigen::Vector3i& n = phantom.labels.grid.size;
  return phantom.labels.labels[(static_cast<std::size_t>(i.z()) * n.y() + i.y()) * n.x() + i.x()];
}

TEST(LabelledPhantom, TheBonesOfThePelvis) {
  const LabelledPhantom phantom = labelledPelvisPhantom(2.5);
  expectBones(phantom, pelvisPhantom(2.5), 7);
  for (const char* name : {"femur_left", "femur_right"}) {
    const Eigen::Vector3d head = phantom.joints_ct_mm.at(name);
    EXPECT_EQ(labelAt(phantom, head), phantom.names.at(name)) << name;
    // The patient's left is +x; the joint lies in the socket, whose bone is medial of it.
    const double side = std::string(name) == "femur_left" ? 1.0 : -1.0;
    EXPECT_GT(side * (head.x() - phantom.ct.grid.centreCt().x()), 80.0);
    const Eigen::Vector3d socket = head - Eigen::Vector3d(side * 31.0, 0.0, 0.0);
    EXPECT_EQ(labelAt(phantom, socket), phantom.names.at(side > 0.0 ? "hip_left" : "hip_right"));
  }
}

TEST(LabelledPhantom, TheBonesOfTheHead) { expectBones(labelledHeadPhantom(2.0), headPhantom(2.0), 6); }

}  // namespace
}  // namespace xray_registration
