#include "xray_registration/volume/attenuation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

Volume filledCt(const Eigen::Vector3i& size, std::int16_t hu) {
  Volume ct;
  ct.grid.size = size;
  ct.grid.spacing_mm = {0.5, 1.0, 2.0};
  ct.grid.origin_ct_mm = {-10.0, 20.0, 300.0};
  ct.hu.assign(ct.grid.voxelCount(), hu);
  ct.name = "test";
  return ct;
}

std::size_t indexOf(const VolumeGrid& grid, int x, int y, int z) {
  return (static_cast<std::size_t>(z) * grid.size.y() + y) * grid.size.x() + x;
}

void fillBox(Volume* ct, const Eigen::Vector3i& low, const Eigen::Vector3i& high, std::int16_t hu) {
  for (int z = low.z(); z < high.z(); ++z) {
    for (int y = low.y(); y < high.y(); ++y) {
      for (int x = low.x(); x < high.x(); ++x) ct->hu[indexOf(ct->grid, x, y, z)] = hu;
    }
  }
}

// The exception's message, or what shows that there was none.
template <typename Work>
std::string messageOf(const Work& work) {
  try {
    work();
  } catch (const VolumeError& error) {
    return error.what();
  }
  return "no VolumeError";
}

TEST(Attenuation, FollowsTheHounsfieldScale) {
  Volume ct = filledCt({4, 4, 4}, -1000);
  const std::int16_t hu[] = {-1024, -801, -800, -500, 0, 40, 1000, 3071};
  for (std::size_t i = 0; i < 8; ++i) ct.hu[i] = hu[i];
  const AttenuationVolume result = toAttenuation(ct, {});
  for (std::size_t i = 0; i < 8; ++i) {
    const double expected = hu[i] < -800 ? 0.0 : 0.02 * (1.0 + hu[i] / 1000.0);
    // Half a step of the 16 bits.
    EXPECT_NEAR(result.values[i] * static_cast<double>(result.scale_per_mm), expected, 0.51 * result.scale_per_mm);
  }
  EXPECT_EQ(result.values[0], 0);
  EXPECT_EQ(result.values[1], 0);
  EXPECT_GT(result.values[2], 0);
  EXPECT_TRUE(result.grid.sameAs(ct.grid));
}

TEST(Attenuation, TheLargestValueTakesTheWholeRange) {
  Volume ct = filledCt({4, 4, 4}, 0);
  ct.hu[7] = 32767;
  const AttenuationVolume result = toAttenuation(ct, {});
  EXPECT_EQ(result.values[7], 65535);
  EXPECT_NEAR(result.values[0] * static_cast<double>(result.scale_per_mm), 0.02, 0.51 * result.scale_per_mm);
}

TEST(Attenuation, NeverNegativeWhateverTheThreshold) {
  Volume ct = filledCt({4, 4, 4}, -1500);
  ct.hu[0] = 0;
  const AttenuationVolume result = toAttenuation(ct, {0.02, -2000.0});
  EXPECT_EQ(result.values[1], 0);
}

TEST(Attenuation, RefusesParametersByName) {
  const Volume ct = filledCt({4, 4, 4}, 0);
  for (const double water : {0.0, -0.02, 20.0, std::nan("")}) {
    EXPECT_NE(messageOf([&] { toAttenuation(ct, {water, -800.0}); }).find("ct/water_attenuation"), std::string::npos);
  }
  for (const double threshold : {1e6, -1e6, std::nan("")}) {
    EXPECT_NE(messageOf([&] { toAttenuation(ct, {0.02, threshold}); }).find("ct/threshold_hu"), std::string::npos);
  }
  // Nothing lies above the threshold.
  EXPECT_NE(messageOf([&] { toAttenuation(ct, {0.02, 100.0}); }).find("ct/threshold_hu"), std::string::npos);
  Volume broken = ct;
  broken.hu.pop_back();
  EXPECT_NE(messageOf([&] { toAttenuation(broken, {}); }).find("'test'"), std::string::npos);
}

TEST(CutFaces, TissueOnAFaceCutsIt) {
  Volume ct = filledCt({40, 30, 20}, -1000);
  fillBox(&ct, {10, 10, 0}, {30, 30, 10}, 40);  // Touches z low and y high.
  const std::array<bool, 6> expected = {false, false, false, true, true, false};
  EXPECT_EQ(toAttenuation(ct, {}).face_is_cut, expected);
}

TEST(CutFaces, EveryFaceIsSeen) {
  for (std::size_t face = 0; face < 6; ++face) {
    Volume ct = filledCt({30, 24, 20}, -1000);
    Eigen::Vector3i low = ct.grid.size / 3;
    Eigen::Vector3i high = 2 * ct.grid.size / 3;
    const int axis = static_cast<int>(face / 2);
    (face % 2 == 0 ? low : high)[axis] = face % 2 == 0 ? 0 : ct.grid.size[axis];
    fillBox(&ct, low, high, 0);
    std::array<bool, 6> expected{};
    expected[face] = true;
    EXPECT_EQ(toAttenuation(ct, {}).face_is_cut, expected) << "face " << face;
  }
}

TEST(CutFaces, AnArmInALargeFieldOfViewIsSeen) {
  Volume ct = filledCt({200, 200, 4}, -1000);
  fillBox(&ct, {90, 90, 0}, {112, 112, 4}, 40);  // 1.2 % of the face.
  EXPECT_TRUE(toAttenuation(ct, {}).face_is_cut[4]);
  EXPECT_FALSE(toAttenuation(ct, {}).face_is_cut[0]);
}

TEST(CutFaces, NoiseFoamAndSpecksDoNotCut) {
  Volume ct = filledCt({60, 60, 60}, -1000);
  std::mt19937 random(3);
  // A quarter of all voxels look like tissue: far more than a scanner's noise does.
  for (auto& hu : ct.hu) hu = random() % 4 == 0 ? 40 : -1000;
  EXPECT_EQ(toAttenuation(ct, {}).face_is_cut, (std::array<bool, 6>{}));
  ct = filledCt({60, 60, 60}, -1000);
  fillBox(&ct, {20, 20, 20}, {40, 40, 40}, 40);
  fillBox(&ct, {10, 55, 0}, {50, 60, 60}, -700);  // A foam mat that goes through.
  fillBox(&ct, {0, 5, 5}, {1, 8, 8}, 3000);       // A speck.
  EXPECT_EQ(toAttenuation(ct, {}).face_is_cut, (std::array<bool, 6>{}));
}

LabelVolume labelsLike(const Volume& ct, std::uint16_t value) {
  LabelVolume labels;
  labels.grid = ct.grid;
  labels.labels.assign(ct.grid.voxelCount(), value);
  return labels;
}

TEST(Labels, OnlyTheLabelRemainsAndCutsNoFace) {
  const Volume ct = filledCt({12, 10, 8}, 200);
  LabelVolume labels = labelsLike(ct, 0);
  labels.labels[indexOf(ct.grid, 3, 4, 0)] = 7;
  labels.labels[indexOf(ct.grid, 5, 4, 2)] = 2;
  const AttenuationVolume result = toAttenuation(ct, {}, labels, 7);
  EXPECT_GT(result.values[indexOf(ct.grid, 3, 4, 0)], 0);
  EXPECT_EQ(std::count_if(result.values.begin(), result.values.end(), [](auto v) { return v != 0; }), 1);
  EXPECT_EQ(toAttenuation(ct, {}, labelsLike(ct, 1), 1).face_is_cut, (std::array<bool, 6>{}));
}

// Every CT voxel is looked up by hand, through CT coordinates, in a label grid that is turned, shifted, finer in one
// axis and coarser in the others, and covers the CT only in part.
TEST(Labels, AnyGridIsSampledThroughTheCtFrame) {
  const Volume ct = filledCt({20, 16, 12}, 100);
  LabelVolume labels;
  labels.grid.size = {9, 40, 7};
  labels.grid.spacing_mm = {1.3, 0.35, 2.9};
  labels.grid.direction = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, -2.0, 0.5).normalized()).toRotationMatrix();
  labels.grid.direction.col(2) *= -1.0;  // Left-handed, as flipped files are.
  labels.grid.origin_ct_mm = ct.grid.centreCt() - labels.grid.direction * Eigen::Vector3d(5.0, 6.0, 9.0);
  std::mt19937 random(11);
  labels.labels.resize(labels.grid.voxelCount());
  for (auto& label : labels.labels) label = static_cast<std::uint16_t>(random() % 3);
  const AttenuationVolume result = toAttenuation(ct, {}, labels, 2);
  int selected = 0;
  for (int z = 0; z < 12; ++z) {
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 20; ++x) {
        const Eigen::Vector3d point = ct.grid.ctFromIndex() * Eigen::Vector3d(x, y, z);
        const Eigen::Vector3d position = labels.grid.direction.transpose() * (point - labels.grid.origin_ct_mm);
        const int u = static_cast<int>(std::lround(position.x() / 1.3));
        const int v = static_cast<int>(std::lround(position.y() / 0.35));
        const int w = static_cast<int>(std::lround(position.z() / 2.9));
        const bool inside = u >= 0 && v >= 0 && w >= 0 && u < 9 && v < 40 && w < 7;
        const bool expected = inside && labels.labels[indexOf(labels.grid, u, v, w)] == 2;
        EXPECT_EQ(result.values[indexOf(ct.grid, x, y, z)] > 0, expected) << x << " " << y << " " << z;
        selected += expected ? 1 : 0;
      }
    }
  }
  EXPECT_GT(selected, 100);  // The grids overlap, so that the comparison means something.
}

TEST(Labels, RefusesWhatSelectsNothing) {
  const Volume ct = filledCt({4, 4, 4}, 0);
  const auto refusal = [&](const LabelVolume& labels, int label) {
    return messageOf([&] { toAttenuation(ct, {}, labels, label); });
  };
  EXPECT_NE(refusal(labelsLike(ct, 1), 3).find("ct/label is 3"), std::string::npos);
  EXPECT_NE(refusal(labelsLike(ct, 1), 0).find("ct/label is 0"), std::string::npos);
  EXPECT_NE(refusal(labelsLike(ct, 1), 70000).find("ct/label"), std::string::npos);
  LabelVolume elsewhere = labelsLike(ct, 1);
  elsewhere.grid.origin_ct_mm.x() += 1000.0;
  EXPECT_NE(refusal(elsewhere, 1).find("overlap"), std::string::npos);
  EXPECT_NE(refusal(LabelVolume{}, 1).find("ct/mask"), std::string::npos);
  const Volume half_air = [&] {
    Volume volume = filledCt({4, 4, 4}, -1000);
    volume.hu[0] = 0;
    return volume;
  }();
  LabelVolume on_air = labelsLike(half_air, 1);
  on_air.labels[0] = 0;
  EXPECT_NE(messageOf([&] { toAttenuation(half_air, {}, on_air, 1); }).find("air"), std::string::npos);
}

TEST(AnatomicalCentre, IsTheMiddleOfTheTissueInCtCoordinates) {
  Volume ct = filledCt({40, 30, 20}, -1000);
  ct.grid.direction = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).toRotationMatrix();
  fillBox(&ct, {4, 6, 3}, {10, 21, 4}, 0);
  const Eigen::Vector3d expected = ct.grid.ctFromIndex() * Eigen::Vector3d(6.5, 13.0, 3.0);
  // Rounding of doubles.
  EXPECT_LT((anatomicalCentreCt(toAttenuation(ct, {})) - expected).norm(), 1e-9);
}

}  // namespace
}  // namespace xray_registration
