#include "image/dicom/loop_x.h"

#include <gtest/gtest.h>

#include <cstring>

#include "xray_registration/image/xray_dicom_geometry.h"

namespace xray_registration {
namespace {

constexpr dicom::Tag kGroup = 0x30BB0000;

std::string bytesOf(const std::vector<double>& values) {
  std::string bytes(values.size() * sizeof(double), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// A beam from behind (source 800 mm at the back) to a detector 1200 mm away, seen from the detector: columns to the
/// patient's left, rows to the feet; the ray at right angles arrives 150 and 100 mm from the first pixel.
std::vector<double> matrix() {
  return {1200, -150, 0,     150 * 800,  // u w = 1200 x + 150 depth, depth = 800 − y
          0,    -100, -1200, 100 * 800,  // v w = −1200 z + 100 depth
          1,    2,    3,     4,          // a display's
          0,    -1,   0,     800};
}

dicom::DataSet file(const std::vector<double>& values, const std::vector<double>& source, bool as_bytes = true) {
  dicom::DataSet set;
  set.elements[kGroup | 0x10].words = {"somebody else"};
  set.elements[kGroup | 0x21].words = {"Navigation Registration 1.0"};
  auto& projection = set.elements[kGroup | 0x2173];
  if (as_bytes) {
    projection.bytes = bytesOf(values);
  } else {
    projection.numbers = values;
  }
  set.elements[kGroup | 0x2180].numbers = source;
  return set;
}

// (x, y, z) of the device is (−x, −z, −y) of the patient.
const std::vector<double> kSource = {0, 0, -800};

DicomGeometry geometryOf(const dicom::DataSet& set, RowColumn pixel_mm = {0.5, 0.5}) {
  DicomHeader header;
  header.width = 600;
  header.height = 400;
  DicomFrame frame;
  frame.imager_spacing_mm = pixel_mm;
  frame.vendor = dicom::loopXProjection(set);
  return dicomGeometry(header, frame);
}

TEST(LoopXTest, TheMatrixIsCutIntoCameraAndPose) {
  for (const bool as_bytes : {true, false}) {
    const DicomGeometry geometry = geometryOf(file(matrix(), kSource, as_bytes));
    ASSERT_TRUE(geometry.camera && geometry.T_camera_isocentre);
    EXPECT_NEAR(*geometry.source_detector_mm.value, 1200, 1e-9);
    EXPECT_NEAR(*geometry.source_isocentre_mm.value, 800, 1e-9);
    EXPECT_NEAR(*geometry.primary_deg.value, 0, 1e-9);
    EXPECT_NEAR(*geometry.secondary_deg.value, 0, 1e-9);
    EXPECT_TRUE(*geometry.mirrored.value);
    EXPECT_NEAR(geometry.camera->fx, 2400, 1e-9);
    EXPECT_NEAR(geometry.camera->cx, 599 - 300, 1e-9);
    EXPECT_NEAR(geometry.camera->cy, 200, 1e-9);
  }
}

TEST(LoopXTest, PointsArriveWhereTheMatrixHasThem) {
  const auto projection = dicom::loopXProjection(file(matrix(), kSource));
  ASSERT_TRUE(projection);
  const DicomGeometry geometry = geometryOf(file(matrix(), kSource));
  const Eigen::Vector3d point(20, -35, 12);
  const Eigen::Vector3d on_detector = projection->detector_from_patient * point.homogeneous();
  const Eigen::Vector2d stored_px = on_detector.head<2>() / on_detector.z() / 0.5;
  const Eigen::Vector2d seen = geometry.camera->project(*geometry.T_camera_isocentre * point);
  EXPECT_NEAR(599 - seen.x(), stored_px.x(), 1e-9);
  EXPECT_NEAR(seen.y(), stored_px.y(), 1e-9);
}

TEST(LoopXTest, WhatIsNoSuchProjectionIsLeft) {
  EXPECT_FALSE(dicom::loopXProjection(file(matrix(), {0, 0, -799})));  // The source stands elsewhere.
  EXPECT_FALSE(dicom::loopXProjection(file(matrix(), {})));
  EXPECT_FALSE(dicom::loopXProjection(file({1, 2, 3}, kSource)));
  dicom::DataSet of_another = file(matrix(), kSource);
  of_another.elements[kGroup | 0x21].words = {"Navigation Registration 2.0"};
  EXPECT_FALSE(dicom::loopXProjection(of_another));
}

TEST(LoopXTest, ASkewedDetectorIsRefusedAndSaid) {
  auto skewed = matrix();
  skewed[2] = 60;  // Columns lean.
  const DicomGeometry geometry = geometryOf(file(skewed, kSource));
  EXPECT_FALSE(geometry.camera);
  ASSERT_FALSE(geometry.warnings.empty());
  EXPECT_NE(geometry.warnings.front().find("Loop-X"), std::string::npos);
}

}  // namespace
}  // namespace xray_registration
