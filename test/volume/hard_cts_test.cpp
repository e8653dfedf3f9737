// The recorded head in files that readers stumble over, against the same head in a plain one.
#include <gtest/gtest.h>

#include <cstdlib>

#include "test/volume/reading.h"
#include "test/volume/test_files.h"

namespace xray_registration {
namespace {

using reading::expectContains;
using reading::read;
using reading::refusal;

class HardCts : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("XRAY_REGISTRATION_DATA");
    if (data == nullptr) GTEST_SKIP() << "XRAY_REGISTRATION_DATA names no folder";
    folder_ = std::string(data) + "/hard_cts/";
    reference_ = readVolume(folder_ + "reference.nii.gz", {}, {});
  }

  void expectReference(const Volume& ct) const {
    // Single precision in some headers.
    EXPECT_TRUE(ct.grid.sameAs(reference_.grid, 1e-3)) << ct.grid.origin_ct_mm.transpose() << "\n" << ct.grid.direction;
  }

  std::string folder_;
  Volume reference_;
};

TEST_F(HardCts, WhatTheFilesSayIsRead) {
  for (const char* name : {"slope_zero_intercept.nii.gz", "micrometres.nii.gz"}) {
    const auto [ct, warned, said] = read(folder_ + name);
    expectReference(ct);
    EXPECT_EQ(ct.hu, reference_.hu) << name;
    EXPECT_EQ(warned, "") << name;
  }
  const auto [ct, warned, said] = read(folder_ + "sform_right_qform_wrong.nii.gz");
  expectReference(ct);
  EXPECT_EQ(ct.hu, reference_.hu);
  expectContains(warned, "sform (code 2) and its qform (code 1) disagree");
}

TEST_F(HardCts, LasHasTheSameHeadInTheSamePlace) {
  const Volume ct = read(folder_ + "las.nrrd").ct;
  expectReference(ct);
  EXPECT_EQ(ct.hu, reference_.hu);
}

TEST_F(HardCts, NoOrientationIsSaidAndCanBeGiven) {
  expectContains(read(folder_ + "no_orientation.nii.gz").warned, "ct/orientation");
  VolumeReadOptions options;
  options.orientation = "LPS";
  const auto [ct, warned, said] = read(folder_ + "no_orientation.nii.gz", options);
  EXPECT_EQ(warned, "");
  EXPECT_EQ(ct.hu, reference_.hu);
  EXPECT_LT((ct.grid.direction - reference_.grid.direction).norm(), 1e-6);
}

TEST_F(HardCts, OffsetValuesAreRefusedUntilTheOffsetIsSaid) {
  expectContains(refusal(folder_ + "hu_plus_1024.nii.gz"), "ct/hu_intercept: -1024");
  VolumeReadOptions options;
  options.hu_intercept = -1024.0;
  const Volume ct = read(folder_ + "hu_plus_1024.nii.gz", options).ct;
  expectReference(ct);
  EXPECT_EQ(ct.hu, reference_.hu);
}

TEST_F(HardCts, AShortRawFileIsRefused) { expectContains(refusal(folder_ + "short.mhd"), "truncated or damaged"); }

TEST_F(HardCts, PaddedSlicesHaveAirAroundTheHead) {
  const test_files::TemporaryFolder unpacked;
  const std::string command = "tar xzf " + folder_ + "dicom_padding_63536.tar.gz -C " + unpacked.path().string();
  ASSERT_EQ(std::system(command.c_str()), 0);
  const auto [ct, warned, said] = read(unpacked.path().string());
  EXPECT_EQ(ct.grid.size, Eigen::Vector3i(128, 128, 28));
  expectContains(said, "padding");
  EXPECT_EQ(ct.hu.front(), -1000);
  // A plastic head: the reference's densest voxel has 799 HU.
  EXPECT_LT(*std::max_element(ct.hu.begin(), ct.hu.end()), 1500);
}

TEST_F(HardCts, NoRecordedCtIsWarnedOf) {
  for (const char* name : {"ct/head_phantom_0.9mm.nii.gz", "ct/head_phantom_dicom_5mm", "ct/pelvis_2mm.nii.gz",
                           "spine/thorax_1.4mm.nii.gz", "wrist/radius.nii.gz", "wrist/ulna.nii.gz"}) {
    EXPECT_EQ(read(folder_ + "../" + name).warned, "") << name;
  }
}

}  // namespace
}  // namespace xray_registration
