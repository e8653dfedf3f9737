#include "xray_registration/volume/body_cut.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <utility>

#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

// Soft tissue with two bones and a vessel; every voxel has an HU of its own.
struct Scene {
  Volume ct;
  LabelVolume labels;

  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * ct.grid.size.y() + y) * ct.grid.size.x() + x;
  }
};

using Box = std::pair<Eigen::Vector3i, Eigen::Vector3i>;

void forBox(const Box& box, const std::function<void(int, int, int)>& visit) {
  for (int z = box.first.z(); z < box.second.z(); ++z) {
    for (int y = box.first.y(); y < box.second.y(); ++y) {
      for (int x = box.first.x(); x < box.second.x(); ++x) visit(x, y, z);
    }
  }
}

const Box kBoneA{{4, 4, 4}, {9, 10, 9}};
const Box kBoneB{{14, 4, 4}, {19, 10, 9}};

Scene makeScene() {
  Scene scene;
  scene.ct.name = "test";
  scene.ct.grid.size = {24, 14, 13};
  scene.ct.grid.spacing_mm = {1.0, 1.5, 2.0};
  scene.ct.grid.origin_ct_mm = {-30.0, 11.0, 500.0};
  scene.ct.hu.resize(scene.ct.grid.voxelCount());
  for (std::size_t i = 0; i < scene.ct.hu.size(); ++i) scene.ct.hu[i] = static_cast<std::int16_t>(i % 61) - 20;
  scene.labels.grid = scene.ct.grid;
  scene.labels.labels.assign(scene.ct.hu.size(), 0);
  const auto add = [&scene](const Box& box, std::uint16_t label, int hu) {
    forBox(box, [&](int x, int y, int z) {
      const std::size_t i = scene.index(x, y, z);
      scene.labels.labels[i] = label;
      scene.ct.hu[i] = static_cast<std::int16_t>(hu + static_cast<int>(i % 300));
    });
  };
  add(kBoneA, 5, 400);
  add(kBoneB, 7, 700);
  return scene;
}

double attenuation(const AttenuationVolume& volume, const Eigen::Vector3d& point_ct_mm) {
  const Eigen::Vector3d index = volume.grid.ctFromIndex().inverse() * point_ct_mm;
  const Eigen::Vector3i i = index.array().round().cast<int>();
  EXPECT_LT((index - i.cast<double>()).norm(), 1e-9);  // The grids share their voxels.
  if ((i.array() < 0).any() || (i.array() >= volume.grid.size.array()).any()) return 0.0;
  const auto voxel = (static_cast<std::size_t>(i.z()) * volume.grid.size.y() + i.y()) * volume.grid.size.x() + i.x();
  return static_cast<double>(volume.values[voxel]) * volume.scale_per_mm;
}

std::string messageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const VolumeError& error) {
    return error.what();
  }
  return "no VolumeError";
}

CutCt cut(const Scene& scene, const std::vector<std::vector<int>>& labels) {
  return cutBodies(scene.ct, {}, scene.labels, labels);
}

TEST(BodyCut, RestAndBodiesAreTheCt) {
  const Scene scene = makeScene();
  const AttenuationVolume whole = toAttenuation(scene.ct, {});
  const CutCt parts = cut(scene, {{5}, {7}});
  ASSERT_EQ(parts.bodies.size(), 2U);
  EXPECT_EQ(parts.rest.face_is_cut, whole.face_is_cut);
  for (const AttenuationVolume& body : parts.bodies) EXPECT_EQ(body.scale_per_mm, whole.scale_per_mm);
  forBox({{0, 0, 0}, whole.grid.size}, [&](int x, int y, int z) {
    const Eigen::Vector3d point = whole.grid.ctFromIndex() * Eigen::Vector3d(x, y, z);
    const double sum =
        attenuation(parts.rest, point) + attenuation(parts.bodies[0], point) + attenuation(parts.bodies[1], point);
    EXPECT_NEAR(sum, attenuation(whole, point), 1e-12);
  });
}

TEST(BodyCut, SoftTissueStaysWhereTheBodyWas) {
  const Scene scene = makeScene();
  const CutCt parts = cut(scene, {{5}});
  const double step = parts.rest.scale_per_mm;
  forBox(kBoneA, [&](int x, int y, int z) {
    const double hu = scene.ct.hu[scene.index(x, y, z)];
    const Eigen::Vector3d point = scene.ct.grid.ctFromIndex() * Eigen::Vector3d(x, y, z);
    EXPECT_NEAR(attenuation(parts.rest, point), 0.02 * 1.04, step);
    EXPECT_NEAR(attenuation(parts.bodies[0], point), 0.02 * (hu - 40.0) / 1000.0, 2.0 * step);
  });
  // The other bone stays in the rest.
  const Eigen::Vector3d other = scene.ct.grid.ctFromIndex() * Eigen::Vector3d(16.0, 6.0, 6.0);
  EXPECT_NEAR(attenuation(parts.rest, other), 0.02 * (1.0 + scene.ct.hu[scene.index(16, 6, 6)] / 1000.0), step);
}

TEST(BodyCut, TakesNothingThatIsThinnerThanSoftTissue) {
  Scene scene = makeScene();
  scene.ct.hu[scene.index(6, 6, 6)] = -700;  // Gas in the bone.
  const CutCt parts = cut(scene, {{5}});
  const Eigen::Vector3d point = scene.ct.grid.ctFromIndex() * Eigen::Vector3d(6.0, 6.0, 6.0);
  EXPECT_EQ(attenuation(parts.bodies[0], point), 0.0);
  EXPECT_NEAR(attenuation(parts.rest, point), 0.02 * 0.3, parts.rest.scale_per_mm);
}

TEST(BodyCut, ABodyIsCroppedToItsBox) {
  const Scene scene = makeScene();
  const CutCt parts = cut(scene, {{7}});
  EXPECT_EQ(parts.bodies[0].grid.size, kBoneB.second - kBoneB.first);
  EXPECT_TRUE(
      parts.bodies[0].grid.origin_ct_mm.isApprox(scene.ct.grid.ctFromIndex() * kBoneB.first.cast<double>().eval()));
  EXPECT_EQ(parts.bodies[0].face_is_cut, (std::array<bool, 6>{}));
}

TEST(BodyCut, TheBodyTakesDenseBorderVoxelsAndNoOthers) {
  Scene scene = makeScene();
  scene.ct.hu[scene.index(9, 6, 6)] = 500;   // Cortex that the segmentation missed.
  scene.ct.hu[scene.index(10, 6, 6)] = 500;  // Two voxels away: not this body's.
  scene.ct.hu[scene.index(9, 7, 6)] = 120;   // Dense soft tissue.
  const AttenuationVolume body = cut(scene, {{5}}).bodies[0];
  const Eigen::Affine3d ct_from_index = scene.ct.grid.ctFromIndex();
  EXPECT_GT(attenuation(body, ct_from_index * Eigen::Vector3d(9.0, 6.0, 6.0)), 0.008);
  EXPECT_EQ(attenuation(body, ct_from_index * Eigen::Vector3d(10.0, 6.0, 6.0)), 0.0);
  EXPECT_EQ(attenuation(body, ct_from_index * Eigen::Vector3d(9.0, 7.0, 6.0)), 0.0);
}

TEST(BodyCut, ANeighbourKeepsItsBorder) {
  for (const std::uint16_t neighbour : {7, 9}) {  // Another body, and a label that is none.
    Scene scene = makeScene();
    scene.ct.hu[scene.index(9, 6, 6)] = 500;
    scene.labels.labels[scene.index(10, 6, 6)] = neighbour;
    const CutCt parts = cut(scene, {{5}, {7}});
    const Eigen::Vector3d point = scene.ct.grid.ctFromIndex() * Eigen::Vector3d(9.0, 6.0, 6.0);
    EXPECT_EQ(attenuation(parts.bodies[0], point), 0.0) << neighbour;
    EXPECT_EQ(attenuation(parts.bodies[1], point), 0.0) << neighbour;
  }
}

TEST(BodyCut, TheBorderIsAsWideAsTheLabelsVoxels) {
  Scene scene = makeScene();
  // Labels of half the resolution: (x, y, z) covers two voxels of each axis.
  scene.labels.grid.size = {12, 7, 6};
  scene.labels.grid.spacing_mm *= 2.0;
  scene.labels.grid.origin_ct_mm += 0.5 * scene.ct.grid.spacing_mm;
  scene.labels.labels.assign(scene.labels.grid.voxelCount(), 0);
  scene.labels.labels[(2 * 7 + 3) * 12 + 3] = 5;  // Voxels 6…7, 6…7, 4…5.
  for (const int x : {8, 9, 10}) scene.ct.hu[scene.index(x, 6, 5)] = 500;
  const AttenuationVolume body = cut(scene, {{5}}).bodies[0];
  const Eigen::Affine3d ct_from_index = scene.ct.grid.ctFromIndex();
  EXPECT_GT(attenuation(body, ct_from_index * Eigen::Vector3d(7.0, 6.0, 5.0)), 0.0);
  EXPECT_GT(attenuation(body, ct_from_index * Eigen::Vector3d(9.0, 6.0, 5.0)), 0.0);
  EXPECT_EQ(attenuation(body, ct_from_index * Eigen::Vector3d(10.0, 6.0, 5.0)), 0.0);
}

TEST(BodyCut, ABodyMayHaveSeveralLabels) {
  const Scene scene = makeScene();
  const CutCt parts = cut(scene, {{5, 7}});
  ASSERT_EQ(parts.bodies.size(), 1U);
  EXPECT_EQ(parts.bodies[0].grid.size, Eigen::Vector3i(15, 6, 5));
}

TEST(BodyCut, NoBodiesLeaveTheCt) {
  const Scene scene = makeScene();
  const CutCt parts = cut(scene, {});
  EXPECT_TRUE(parts.bodies.empty());
  EXPECT_EQ(parts.rest.values, toAttenuation(scene.ct, {}).values);
}

TEST(BodyCut, WhatIsAirForTheModelLeavesAHole) {
  // Bones alone: soft tissue counts as air, so a moved bone leaves nothing behind.
  const Scene scene = makeScene();
  const CutCt parts = cutBodies(scene.ct, {0.02, 300.0}, scene.labels, {{5}});
  const Eigen::Vector3d point = scene.ct.grid.ctFromIndex() * Eigen::Vector3d(6.0, 6.0, 6.0);
  EXPECT_EQ(attenuation(parts.rest, point), 0.0);
}

TEST(BodyCut, RefusesLabelsByName) {
  const Scene scene = makeScene();
  const auto said = [&scene](const std::vector<std::vector<int>>& labels) {
    return messageOf([&] { cut(scene, labels); });
  };
  EXPECT_NE(said({{5}, {6}}).find("ct/mask: no voxel of the CT 'test' has label 6"), std::string::npos);
  EXPECT_NE(said({{5, 7}, {7}}).find("label 7 stands twice"), std::string::npos);
  EXPECT_NE(said({{0}}).find("label 0"), std::string::npos);
  EXPECT_NE(said({{70000}}).find("label 70000"), std::string::npos);
  EXPECT_NE(said({{5}, {}}).find("no label"), std::string::npos);
  Scene thin = makeScene();
  forBox(kBoneB, [&](int x, int y, int z) { thin.ct.hu[thin.index(x, y, z)] = 30; });
  EXPECT_NE(messageOf([&] { cut(thin, {{7}}); }).find("label 7 of the CT 'test' holds nothing denser"),
            std::string::npos);
  Scene broken = makeScene();
  broken.labels.labels.pop_back();
  EXPECT_NE(messageOf([&] { cut(broken, {{5}}); }).find("ct/mask"), std::string::npos);
}

}  // namespace
}  // namespace xray_registration
