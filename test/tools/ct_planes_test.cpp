#include <gtest/gtest.h>

#include "tools/inspect_ct/planes.h"

namespace xray_registration::tools {
namespace {

// A CT of 40 mm with a bright block towards the patient's left, back and head, stored in any order of its axes.
Volume blockCt(const Eigen::Matrix3d& direction) {
  Volume ct;
  ct.grid.size = {20, 20, 20};
  ct.grid.spacing_mm = {2.0, 2.0, 2.0};
  ct.grid.direction = direction;
  ct.grid.origin_ct_mm = -direction * Eigen::Vector3d(19, 19, 19);  // Centred in the origin.
  const Eigen::Affine3d ct_from_index = ct.grid.ctFromIndex();
  for (int z = 0; z < 20; ++z) {
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < 20; ++x) {
        const Eigen::Vector3d place = ct_from_index * Eigen::Vector3d(x, y, z);
        // Reaches over the middle, through which the planes go.
        ct.hu.push_back((place.array() > -3.0).all() ? 1000 : -1000);
      }
    }
  }
  return ct;
}

unsigned char greyAt(const cv::Mat& picture, int u, int v) { return picture.at<cv::Vec3b>(v, u)[0]; }

TEST(ThreePlanes, ShowThePatientFromTheRightSidesHoweverTheFileIsStored) {
  Eigen::Matrix3d turned;
  turned << 0, 0, -1, 1, 0, 0, 0, -1, 0;
  for (const Eigen::Matrix3d& direction : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), turned}) {
    const cv::Mat picture = threePlanes(blockCt(direction));
    const int plane = picture.cols / 3;
    const int middle = plane / 2;
    // Left is on the right; the back is below in axial pictures and on the right in sagittal ones; the head is up.
    EXPECT_EQ(greyAt(picture, middle + 100, middle + 100), 255);
    EXPECT_EQ(greyAt(picture, middle - 100, middle + 100), 0);
    EXPECT_EQ(greyAt(picture, middle + 100, middle - 100), 0);
    EXPECT_EQ(greyAt(picture, plane + middle + 100, middle - 100), 255);
    EXPECT_EQ(greyAt(picture, plane + middle - 100, middle - 100), 0);
    EXPECT_EQ(greyAt(picture, plane + middle + 100, middle + 100), 0);
    EXPECT_EQ(greyAt(picture, 2 * plane + middle + 100, middle - 100), 255);
    EXPECT_EQ(greyAt(picture, 2 * plane + middle - 100, middle - 100), 0);
  }
}

}  // namespace
}  // namespace xray_registration::tools
