#include "evaluation/wrong_ct.h"

#include <gtest/gtest.h>

#include <cmath>

#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

const XrayCamera kCamera{65, 49, 300.0, 300.0, 32.0, 24.0};

RigidTransform somePose(const Eigen::Vector3d& centre_ct_mm, double depth_mm) {
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() = rotationFromVector(Eigen::Vector3d(0.3, -0.5, 0.2));
  T_camera_ct.translation() = Eigen::Vector3d(0.0, 0.0, depth_mm) - T_camera_ct.linear() * centre_ct_mm;
  return T_camera_ct;
}

FloatImage drrOf(const Volume& ct, const RigidTransform& T_camera_ct) {
  return referenceProjection(toAttenuation(ct, {}), T_camera_ct, kCamera);
}

/// The head in a grid with oblique axes of which two are exchanged.
Volume obliqueHead() {
  Volume ct = headPhantom(8.0);
  Eigen::Matrix3d exchanged;
  exchanged << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  ct.grid.direction = rotationFromVector(Eigen::Vector3d(0.1, 0.05, -0.2)) * exchanged;
  return ct;
}

void expectAlike(const FloatImage& a, const FloatImage& b, double tolerance) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    EXPECT_NEAR(a.pixels[i], b.pixels[i], tolerance);
    largest = std::max<double>(largest, a.pixels[i]);
  }
  EXPECT_GT(largest, 1.0);  // There is something to be seen.
}

/// Line integrals reach 6; both are rounded to float, and rays that graze a voxel's face may take either side.
constexpr double kDrrTolerance = 1e-3;

TEST(WrongCt, ATooLargeCtLooksLikeTheRightOneNearer) {
  const Volume ct = obliqueHead();
  const Volume larger = scaled(ct, Eigen::Vector3d::Constant(1.25));
  EXPECT_LT((larger.grid.centreCt() - ct.grid.centreCt()).norm(), 1e-9);
  EXPECT_EQ(larger.hu, ct.hu);
  // Similar triangles: 1.25 times as large at 1000 mm is what stands at 800 mm, with rays 1.25 times as long inside.
  FloatImage nearer = drrOf(ct, somePose(ct.grid.centreCt(), 800.0));
  for (float& value : nearer.pixels) value *= 1.25F;
  expectAlike(drrOf(larger, somePose(ct.grid.centreCt(), 1000.0)), nearer, kDrrTolerance);
}

TEST(WrongCt, FactorsBelongToThePatientsAxes) {
  const Volume ct = obliqueHead();
  const Volume longer = scaled(ct, Eigen::Vector3d(1.0, 1.1, 1.0));
  // The patient's y is nearest to the first index axis.
  EXPECT_DOUBLE_EQ(longer.grid.spacing_mm.x(), 1.1 * ct.grid.spacing_mm.x());
  EXPECT_EQ(longer.grid.spacing_mm.y(), ct.grid.spacing_mm.y());
  EXPECT_EQ(longer.grid.spacing_mm.z(), ct.grid.spacing_mm.z());
  EXPECT_EQ(longer.grid.direction, ct.grid.direction);
}

TEST(WrongCt, AMirroredCtIsSeenInAMirror) {
  const Volume ct = obliqueHead();
  const Volume other_side = mirrored(ct);
  EXPECT_NEAR(other_side.grid.direction.determinant(), ct.grid.direction.determinant(), 1e-12);
  EXPECT_LT((other_side.grid.centreCt() - ct.grid.centreCt()).norm(), 1e-9);
  // A mirror before the camera (x of the camera) and the patient mirrored (x of the CT) make a pose of the right CT.
  const RigidTransform T_camera_ct = somePose(ct.grid.centreCt(), 900.0);
  const Eigen::DiagonalMatrix<double, 3> mirror(-1.0, 1.0, 1.0);
  RigidTransform T_mirrored = RigidTransform::Identity();
  T_mirrored.linear() = mirror * T_camera_ct.linear() * mirror;
  T_mirrored.translation() = mirror * (T_camera_ct * ct.grid.centreCt()) - T_mirrored.linear() * ct.grid.centreCt();
  const FloatImage seen = drrOf(other_side, T_camera_ct);
  const FloatImage right = drrOf(ct, T_mirrored);
  FloatImage in_mirror = right;
  for (int v = 0; v < right.height; ++v) {
    for (int u = 0; u < right.width; ++u) in_mirror.at(u, v) = right.at(right.width - 1 - u, v);
  }
  expectAlike(seen, in_mirror, kDrrTolerance);
  // Not because the head were symmetric.
  double difference = 0.0;
  const FloatImage untouched = drrOf(ct, T_camera_ct);
  for (std::size_t i = 0; i < seen.pixels.size(); ++i) {
    difference = std::max<double>(difference, std::abs(seen.pixels[i] - untouched.pixels[i]));
  }
  EXPECT_GT(difference, 0.1);
  EXPECT_EQ(mirrored(other_side).hu, ct.hu);
  EXPECT_TRUE(mirrored(other_side).grid.sameAs(ct.grid));
}

constexpr double kHuPerMm = 10.0;

/// A body throughout whose HU tell the position along one axis of the CT, so that a change of HU is a displacement.
Volume ramp(int axis) {
  Volume ct;
  ct.grid.size = {40, 36, 44};
  ct.grid.spacing_mm = {2.0, 2.5, 2.0};
  ct.grid.origin_ct_mm = {-30.0, 15.0, 100.0};
  for (int z = 0; z < ct.grid.size.z(); ++z) {
    for (int y = 0; y < ct.grid.size.y(); ++y) {
      for (int x = 0; x < ct.grid.size.x(); ++x) {
        const Eigen::Vector3d point_mm = ct.grid.ctFromIndex() * Eigen::Vector3d(x, y, z);
        ct.hu.push_back(static_cast<std::int16_t>(std::lround(kHuPerMm * (point_mm - ct.grid.centreCt())[axis])));
      }
    }
  }
  return ct;
}

/// Where a warped CT took a voxel from, and where it stands; relative to the centre.
struct Displaced {
  Eigen::Vector3d at_mm;
  Eigen::Vector3d from_mm;
};

/// All voxels but a border, from beyond which nothing can be taken.
template <typename Warp>
std::vector<Displaced> displacements(const Warp& warp, int border) {
  const Volume warped[] = {warp(ramp(0)), warp(ramp(1)), warp(ramp(2))};
  const VolumeGrid& grid = warped[0].grid;
  EXPECT_TRUE(grid.sameAs(ramp(0).grid));
  std::vector<Displaced> found;
  std::size_t i = 0;
  for (int z = 0; z < grid.size.z(); ++z) {
    for (int y = 0; y < grid.size.y(); ++y) {
      for (int x = 0; x < grid.size.x(); ++x, ++i) {
        const Eigen::Vector3i index(x, y, z);
        if (index.minCoeff() < border || (grid.size - index).minCoeff() <= border) continue;
        const Eigen::Vector3d from_hu(warped[0].hu[i], warped[1].hu[i], warped[2].hu[i]);
        found.push_back({grid.ctFromIndex() * index.cast<double>() - grid.centreCt(), from_hu / kHuPerMm});
      }
    }
  }
  return found;
}

/// HU are rounded twice, by at most half of one each.
constexpr double kHuRoundingMm = 1.0 / kHuPerMm;

TEST(WrongCt, ShearMovesAlongXAndZWithoutTurning) {
  constexpr double kShear = 0.1;
  for (const Displaced& voxel : displacements([](const Volume& ct) { return sheared(ct, kShear); }, 4)) {
    const Eigen::Vector3d& from = voxel.from_mm;
    const Eigen::Vector3d sheared_mm(from.x() + 0.5 * kShear * from.z(), from.y(), from.z() + 0.5 * kShear * from.x());
    EXPECT_LT((sheared_mm - voxel.at_mm).cwiseAbs().maxCoeff(), 1.1 * kHuRoundingMm);
  }
}

TEST(WrongCt, BendingIsSmoothOfItsSizeAndNoMotion) {
  constexpr double kLargestMm = 4.0;
  const auto voxels = displacements([](const Volume& ct) { return bent(ct, kLargestMm, 3); }, 3);
  double largest_mm = 0.0;
  double steepest = 0.0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  double arm = 0.0;
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const Eigen::Vector3d moved = voxels[i].from_mm - voxels[i].at_mm;
    largest_mm = std::max(largest_mm, moved.norm());
    mean += moved / static_cast<double>(voxels.size());
    turn += voxels[i].at_mm.cross(moved);
    arm += voxels[i].at_mm.squaredNorm();
    if (i > 0 && voxels[i].at_mm.z() == voxels[i - 1].at_mm.z() && voxels[i].at_mm.y() == voxels[i - 1].at_mm.y()) {
      const Eigen::Vector3d before = voxels[i - 1].from_mm - voxels[i - 1].at_mm;
      steepest = std::max(steepest, (moved - before).norm() / 2.0);
    }
  }
  // The largest may lie in the border that is left out, but not all of it.
  EXPECT_LT(largest_mm, kLargestMm + 2.0 * kHuRoundingMm);
  EXPECT_GT(largest_mm, 0.5 * kLargestMm);
  // The body that no motion is left of is the whole grid; the border's share of it is a third.
  EXPECT_LT(mean.norm(), 0.1 * kLargestMm);
  EXPECT_LT(turn.norm() / arm, 0.01);
  // The shortest wave is 0.7 · 90 mm long: less than 4 mm · 2π/63 mm a mm, and the rounding of two HU over 2 mm.
  EXPECT_LT(steepest, kLargestMm * 2.0 * 3.1416 / 63.0 + kHuRoundingMm);
}

TEST(WrongCt, BendingFollowsItsSeed) {
  const Volume ct = ramp(0);
  EXPECT_EQ(bent(ct, 4.0, 1).hu, bent(ct, 4.0, 1).hu);
  EXPECT_NE(bent(ct, 4.0, 1).hu, bent(ct, 4.0, 2).hu);
  EXPECT_EQ(bent(ct, 0.0, 1).hu, ct.hu);
}

TEST(WrongCt, AnotherCtIsPutWhereTheRightOneWas) {
  const Volume place = ramp(0);
  const Volume other = obliqueHead();
  const Volume put = centredLike(place, other);
  EXPECT_LT((put.grid.centreCt() - place.grid.centreCt()).norm(), 1e-9);
  EXPECT_EQ(put.grid.direction, other.grid.direction);
  EXPECT_EQ(put.hu, other.hu);
}

}  // namespace
}  // namespace xray_registration
