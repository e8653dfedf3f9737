#include "xray_registration/pipeline/initial_pose_scope.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(InitialPoseScope, IsForTheCtOfTheParameters) {
  InitialPoseScope scope("/data/head.nii", "");
  EXPECT_FALSE(scope.covers("/data/pelvis.nii", ""));
  EXPECT_TRUE(scope.covers("/data/head.nii", ""));
  EXPECT_TRUE(scope.covers("/data/../data/./head.nii", ""));
  EXPECT_FALSE(scope.covers("/data/pelvis.nii", ""));
}

TEST(InitialPoseScope, IsForTheFirstCtWhereTheParametersNameNone) {
  InitialPoseScope scope("", "");
  EXPECT_TRUE(scope.covers("/data/head.nii", ""));
  EXPECT_FALSE(scope.covers("/data/pelvis.nii", ""));
  EXPECT_TRUE(scope.covers("/data/head.nii", ""));
}

TEST(InitialPoseScope, KnowsSeriesOfOneFolderApart) {
  InitialPoseScope scope("/data/dicom", "1.2.3");
  EXPECT_TRUE(scope.covers("/data/dicom", ""));  // ct/series_uid stands for an empty one.
  EXPECT_TRUE(scope.covers("/data/dicom/", "1.2.3"));
  EXPECT_FALSE(scope.covers("/data/dicom", "1.2.4"));
}

}  // namespace
}  // namespace xray_registration
