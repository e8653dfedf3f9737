// Numbers that are no Hounsfield units are refused with the remedy, and the remedy works.
#include <gtest/gtest.h>

#include <limits>

#include "test/volume/nifti_writer.h"
#include "test/volume/reading.h"
#include "xray_registration/volume/hu_landmarks.h"

namespace xray_registration {
namespace {

using reading::bodyHu;
using reading::expectContains;
using reading::read;
using reading::refusal;
using reading::scaled;
using reading::setOutside;
using test_files::NiftiFile;
using test_files::TemporaryFolder;

template <typename T>
struct NiftiTypeOf;
template <>
struct NiftiTypeOf<std::uint8_t> : std::integral_constant<std::int16_t, 2> {};
template <>
struct NiftiTypeOf<std::int16_t> : std::integral_constant<std::int16_t, 4> {};
template <>
struct NiftiTypeOf<float> : std::integral_constant<std::int16_t, 16> {};
template <>
struct NiftiTypeOf<std::uint16_t> : std::integral_constant<std::int16_t, 512> {};

class HuValues : public testing::Test {
 protected:
  template <typename T>
  std::string write(const std::vector<T>& voxels) const {
    NiftiFile file;
    file.sform_code = 1;
    file.srow = {{{-2, 0, 0, 0}, {0, -3, 0, 0}, {0, 0, 4, 0}}};
    file.size = {reading::kBodySide, reading::kBodySide, reading::kBodySlices};
    file.datatype = NiftiTypeOf<T>::value;
    setVoxels(voxels, &file);
    test_files::writeBytes(folder_ / "a.nii", niftiBytes(file));
    return folder_ / "a.nii";
  }

  // Refused in words that hold `part`; with the remedy the HU are right to `tolerance`.
  template <typename T>
  void expectRemedy(const std::vector<T>& voxels, const std::string& part, double slope, double intercept,
                    double tolerance = 0.5) {
    const std::string path = write(voxels);
    expectContains(refusal(path), part);
    expectContains(refusal(path), "ct/check_values");
    VolumeReadOptions options;
    options.hu_slope = slope;
    options.hu_intercept = intercept;
    const auto [ct, warned, said] = read(path, options);
    EXPECT_EQ(warned, "");
    const std::vector<double> hu = bodyHu();
    for (std::size_t i = 0; i < hu.size(); ++i) ASSERT_NEAR(ct.hu[i], hu[i], tolerance) << i;
    options = {};
    options.check_values = false;
    expectContains(read(path, options).warned, part);
  }

  TemporaryFolder folder_;
};

TEST_F(HuValues, HounsfieldUnitsAreInOrder) {
  for (const double noise : {0.0, 1.0}) {
    std::vector<double> hu = bodyHu();
    if (noise == 0.0) {
      for (double& value : hu) value = value < -500 ? -1000 : value < 0 ? -100 : value < 300 ? 45 : 900;
    }
    const auto [ct, warned, said] = read(write(scaled<std::int16_t>(hu)));
    EXPECT_EQ(warned, "");
    EXPECT_EQ(ct.hu, scaled<std::int16_t>(hu));
    EXPECT_EQ(read(write(scaled<float>(hu))).ct.hu, ct.hu);
  }
}

TEST_F(HuValues, Offsets) {
  expectRemedy(scaled<std::int16_t>(bodyHu(), 1.0, 1024.0), "ct/hu_intercept: -1024", 1.0, -1024.0);
  expectRemedy(scaled<std::uint16_t>(bodyHu(), 1.0, 1024.0), "ct/hu_intercept: -1024", 1.0, -1024.0);
  expectRemedy(scaled<std::int16_t>(bodyHu(), 1.0, -1024.0), "ct/hu_intercept: 1024", 1.0, 1024.0);
}

TEST_F(HuValues, TurnedRound) { expectRemedy(scaled<std::int16_t>(bodyHu(), -1.0, 0.0), "ct/hu_slope: -1", -1.0, 0.0); }

TEST_F(HuValues, Attenuation) {
  expectRemedy(scaled<float>(bodyHu(), 0.02 / 1000.0, 0.02), "ct/hu_slope: 50000", 50000.0, -1000.0, 1.0);
  expectRemedy(scaled<float>(bodyHu(), 0.2 / 1000.0, 0.2), "ct/hu_slope: 5000", 5000.0, -1000.0, 1.0);
}

TEST_F(HuValues, ScaledToOneOrToEightBits) {
  expectRemedy(scaled<float>(bodyHu(), 1.0 / 2100.0, 1100.0 / 2100.0), "scaled to 0", 2100.0, -1100.0, 1.0);
  expectRemedy(scaled<std::uint8_t>(bodyHu(), 255.0 / 2100.0, 255.0 * 1100.0 / 2100.0), "8 bits", 2100.0 / 255.0,
               -1100.0, 9.0);
  // The same numbers in more bits.
  std::vector<std::uint8_t> eight = scaled<std::uint8_t>(bodyHu(), 255.0 / 2100.0, 255.0 * 1100.0 / 2100.0);
  expectContains(refusal(write(std::vector<std::int16_t>(eight.begin(), eight.end()))), "8 bits");
}

TEST_F(HuValues, BeyondAnyScale) {
  std::vector<float> voxels = scaled<float>(bodyHu());
  voxels[100] = 1e30F;
  expectContains(refusal(write(voxels)), "ct/padding");
  VolumeReadOptions options;
  options.padding = 1e30;
  EXPECT_EQ(read(write(voxels), options).ct.hu[100], -1000);
  voxels[100] = -1e30F;
  expectContains(refusal(write(voxels)), "no Hounsfield units");
  // In a small volume too, whose histogram says nothing.
  NiftiFile file;
  file.sform_code = 1;
  file.srow = {{{2, 0, 0, 0}, {0, 3, 0, 0}, {0, 0, 4, 0}}};
  file.datatype = 16;
  setVoxels(std::vector<float>(24, 1e30F), &file);
  test_files::writeBytes(folder_ / "small.nii", niftiBytes(file));
  expectContains(refusal(folder_ / "small.nii"), "no Hounsfield units");
}

TEST_F(HuValues, WhatIsNotFiniteIsAirAndSaid) {
  std::vector<float> voxels = scaled<float>(bodyHu());
  voxels[7000 - 100] = std::numeric_limits<float>::infinity();
  voxels[100] = std::nanf("");
  const auto [ct, warned, said] = read(write(voxels));
  expectContains(warned, "2 of its voxels hold no finite number");
  EXPECT_EQ(ct.hu[100], -1000);
  EXPECT_EQ(ct.hu[7000 - 100], -1000);
}

TEST_F(HuValues, DensePaddingAroundARoundFieldIsAir) {
  for (const std::uint16_t stored : {63536, 65535, 32768, 4095}) {
    // As unsigned numbers with the scanner's intercept.
    std::vector<std::uint16_t> voxels = scaled<std::uint16_t>(bodyHu(), 1.0, 1024.0);
    setOutside(stored, &voxels);
    // The padding does not hide that the rest is no Hounsfield units.
    expectContains(refusal(write(voxels)), "ct/hu_intercept: -1024");
    voxels[12 * 24 + 12] = 4095;  // Metal in the body.
    VolumeReadOptions options;
    options.hu_intercept = -1024.0;
    const auto [ct, warned, said] = read(write(voxels), options);
    expectContains(warned, "padding and taken as air");
    std::vector<double> expected = bodyHu();
    setOutside(-1000.0, &expected);
    expected[12 * 24 + 12] = 3071;
    for (std::size_t i = 0; i < expected.size(); ++i) ASSERT_EQ(ct.hu[i], expected[i]) << stored << " " << i;
  }
}

TEST_F(HuValues, PaddingAsThinAsAirIsLeft) {
  std::vector<std::int16_t> voxels = scaled<std::int16_t>(bodyHu());
  setOutside(std::int16_t{-2000}, &voxels);
  const auto [ct, warned, said] = read(write(voxels));
  EXPECT_EQ(ct.hu, voxels);
  EXPECT_EQ(warned, "");
}

TEST_F(HuValues, AMaskedBone) {
  std::vector<double> bone = bodyHu();
  for (double& hu : bone) hu = hu < 300.0 ? -1000.0 : hu;
  EXPECT_EQ(read(write(scaled<std::int16_t>(bone))).warned, "");
  for (double& hu : bone) hu = hu < 300.0 ? 0.0 : hu;
  const std::string path = write(scaled<std::int16_t>(bone));
  expectContains(refusal(path), "ct/padding: 0");
  VolumeReadOptions options;
  options.padding = 0.0;
  EXPECT_EQ(read(path, options).warned, "");
  EXPECT_EQ(read(path, options).ct.hu[0], -1000);
}

TEST_F(HuValues, CutOutFromWithinABodyIsOnlyWarnedOf) {
  std::vector<double> inside = bodyHu();
  unsigned place = 0;
  for (double& hu : inside) {
    if (hu < -500.0) hu = ++place % 3 == 0 ? -110.0 : 50.0;
  }
  const auto [ct, warned, said] = read(write(scaled<std::int16_t>(inside)));
  expectContains(warned, "cut out from within a body");
}

TEST_F(HuValues, AnMrImage) {
  std::vector<double> mr = bodyHu();
  for (double& value : mr) {
    value = value < -500.0 ? std::abs(value + 1000.0) : value < 0.0 ? 400.0 : value < 300.0 ? 200.0 : 20.0;
  }
  expectContains(refusal(write(scaled<std::int16_t>(mr))), "MR");
}

TEST_F(HuValues, Landmarks) {
  const HuLandmarks marks = huLandmarks(read(write(scaled<std::int16_t>(bodyHu()))).ct);
  EXPECT_NEAR(marks.air_hu.value_or(0), -1000, 12);
  EXPECT_NEAR(marks.soft_tissue_hu.value_or(0), 45, 12);
  EXPECT_NEAR(marks.air_share, 1.0 - M_PI * 81.0 / 576.0, 0.02);
  EXPECT_NEAR(marks.bone_share, M_PI * 6.25 / 576.0, 0.01);
  EXPECT_EQ(marks.metal_share, 0.0);
  EXPECT_LT(marks.low_hu, -1005);
  EXPECT_GT(marks.high_hu, 900);
}

}  // namespace
}  // namespace xray_registration
