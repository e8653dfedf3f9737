#include <gtest/gtest.h>

#include <cmath>

#include "xray_registration/image/xray_dicom_geometry.h"

namespace xray_registration {
namespace {

DicomHeader header(int width = 512, int height = 400) {
  DicomHeader header;
  header.modality = "XA";
  header.width = width;
  header.height = height;
  return header;
}

DicomFrame wholeFrame() {
  DicomFrame frame;
  frame.source_detector_mm = 1000;
  frame.source_isocentre_mm = 750;
  frame.imager_spacing_mm = RowColumn{0.5, 0.4};
  frame.primary_deg = 0;
  frame.secondary_deg = 0;
  return frame;
}

std::vector<std::string> remedies(const DicomGeometry& geometry, bool for_pose) {
  std::vector<std::string> options;
  for (const MissingGeometry& one : geometry.missing) {
    if (one.for_pose == for_pose) options.push_back(one.remedy);
  }
  return options;
}

/// The column and row of the picture as it is stored where a point of the patient is seen.
Eigen::Vector2d storedPixel(const DicomGeometry& geometry, const Eigen::Vector3d& point) {
  Eigen::Vector2d pixel = geometry.camera->project(*geometry.T_camera_isocentre * point);
  if (*geometry.mirrored.value) pixel.x() = geometry.camera->width - 1 - pixel.x();
  return pixel;
}

TEST(DicomGeometryTest, NumbersThatMakeNoCamera) {
  DicomFrame frame = wholeFrame();
  frame.source_detector_mm = 1e300;
  frame.imager_spacing_mm = RowColumn{1e-300, 1e-300};
  const DicomGeometry geometry = dicomGeometry(header(), frame);
  EXPECT_FALSE(geometry.camera);
  EXPECT_EQ(remedies(geometry, false), std::vector<std::string>{"--source-detector-mm, --pixel-mm"});
}

TEST(DicomGeometryTest, DistancesAndPixelsMakeACamera) {
  const DicomGeometry geometry = dicomGeometry(header(), wholeFrame());
  ASSERT_TRUE(geometry.camera);
  EXPECT_DOUBLE_EQ(geometry.camera->fx, 2500);  // By the spacing of columns, which comes second.
  EXPECT_DOUBLE_EQ(geometry.camera->fy, 2000);
  EXPECT_DOUBLE_EQ(geometry.camera->cx, 255.5);
  EXPECT_DOUBLE_EQ(geometry.camera->cy, 199.5);
  EXPECT_TRUE(geometry.missing.empty());
  EXPECT_TRUE(geometry.warnings.empty());
}

TEST(DicomGeometryTest, AtZeroThePatientsLeftIsOnTheRightAndTheHeadOnTop) {
  const DicomGeometry geometry = dicomGeometry(header(), wholeFrame());
  EXPECT_TRUE(*geometry.mirrored.value);  // No camera has its axes along such columns, rows and beam.
  ASSERT_TRUE(geometry.T_camera_isocentre);
  EXPECT_NEAR(geometry.T_camera_isocentre->linear().determinant(), 1, 1e-12);
  const Eigen::Vector2d middle = storedPixel(geometry, {0, 0, 0});
  EXPECT_NEAR(middle.x(), 255.5, 1e-9);
  // 3 mm at the isocentre are 4 mm on the detector.
  EXPECT_NEAR(storedPixel(geometry, {3, 0, 0}).x() - middle.x(), 10, 1e-9);
  EXPECT_NEAR(storedPixel(geometry, {0, 0, 3}).y() - middle.y(), -8, 1e-9);
  // The source is behind the patient: what lies there is magnified more.
  EXPECT_GT(storedPixel(geometry, {3, 100, 0}).x(), storedPixel(geometry, {3, 0, 0}).x());
}

TEST(DicomGeometryTest, TheFieldsTurnAndFlipAreFollowed) {
  DicomFrame frame = wholeFrame();
  frame.field_rotation_deg = 180;
  frame.field_flipped = true;
  const DicomGeometry geometry = dicomGeometry(header(), frame);
  EXPECT_FALSE(*geometry.mirrored.value);
  // Upside down, and flipped back: left on the right still, the head below.
  EXPECT_GT(storedPixel(geometry, {3, 0, 0}).x(), 255.5);
  EXPECT_GT(storedPixel(geometry, {0, 0, 3}).y(), 199.5);
}

TEST(DicomGeometryTest, WordsForThePatientsDirectionsWin) {
  DicomFrame frame = wholeFrame();
  frame.field_rotation_deg = 0;
  frame.field_flipped = false;
  frame.patient_orientation = {"R", "F"};
  const DicomGeometry geometry = dicomGeometry(header(), frame);
  EXPECT_FALSE(*geometry.mirrored.value);
  EXPECT_LT(storedPixel(geometry, {3, 0, 0}).x(), 255.5);
  EXPECT_EQ(geometry.mirrored.source, "PatientOrientation (0020,0020)");
  ASSERT_EQ(geometry.warnings.size(), 1U);
  EXPECT_NE(geometry.warnings.front().find("contradicts"), std::string::npos);
}

TEST(DicomGeometryTest, WordsThatFitNoDirectionAreSaid) {
  DicomFrame frame = wholeFrame();
  frame.patient_orientation = {"A", "F"};  // The beam's own direction.
  const DicomGeometry geometry = dicomGeometry(header(), frame);
  EXPECT_TRUE(*geometry.mirrored.value);
  ASSERT_EQ(geometry.warnings.size(), 1U);
  EXPECT_NE(geometry.warnings.front().find("does not fit"), std::string::npos);
  frame.patient_orientation = {"", ""};
  EXPECT_TRUE(dicomGeometry(header(), frame).warnings.empty());
}

TEST(DicomGeometryTest, AnEmptyFileMissesEverythingByName) {
  const DicomGeometry geometry = dicomGeometry(header(), DicomFrame{});
  EXPECT_FALSE(geometry.camera);
  EXPECT_FALSE(geometry.T_camera_isocentre);
  EXPECT_EQ(remedies(geometry, false), (std::vector<std::string>{"--source-detector-mm", "--pixel-mm"}));
  EXPECT_EQ(remedies(geometry, true),
            (std::vector<std::string>{"--source-patient-mm", "--primary-deg", "--secondary-deg"}));
  EXPECT_NE(geometry.missing.front().what.find("(0018,1110)"), std::string::npos);
}

TEST(DicomGeometryTest, WhatIsGivenByHandWins) {
  GivenGeometry given;
  given.source_detector_mm = 1200;
  given.source_isocentre_mm = 600;
  given.pixel_mm = RowColumn{0.3, 0.3};
  given.principal_point_px = Eigen::Vector2d(100, 50);
  given.primary_deg = 90;
  given.secondary_deg = 0;
  given.mirrored = false;
  for (const DicomFrame& frame : {DicomFrame{}, wholeFrame()}) {
    const DicomGeometry geometry = dicomGeometry(header(), frame, given);
    ASSERT_TRUE(geometry.camera && geometry.T_camera_isocentre);
    EXPECT_TRUE(geometry.missing.empty());
    EXPECT_DOUBLE_EQ(geometry.camera->fx, 4000);
    EXPECT_DOUBLE_EQ(geometry.camera->cx, 100);
    EXPECT_DOUBLE_EQ(geometry.camera->cy, 50);
    EXPECT_FALSE(*geometry.mirrored.value);
    EXPECT_EQ(geometry.primary_deg.source, "--primary-deg");
    // The beam goes to the patient's left.
    EXPECT_NEAR((*geometry.T_camera_isocentre * Eigen::Vector3d(50, 0, 0)).z(), 650, 1e-9);
  }
}

TEST(DicomGeometryTest, APrincipalPointIsOfTheStoredPicture) {
  GivenGeometry given;
  given.principal_point_px = Eigen::Vector2d(100, 50);
  const DicomGeometry geometry = dicomGeometry(header(), wholeFrame(), given);
  ASSERT_TRUE(*geometry.mirrored.value);
  EXPECT_DOUBLE_EQ(geometry.camera->cx, 511 - 100);
  EXPECT_DOUBLE_EQ(geometry.camera->cy, 50);
}

TEST(DicomGeometryTest, TheMagnificationGivesOneDistance) {
  DicomFrame frame = wholeFrame();
  frame.magnification = 1.25;
  frame.source_detector_mm.reset();
  EXPECT_DOUBLE_EQ(*dicomGeometry(header(), frame).source_detector_mm.value, 937.5);
  frame.source_detector_mm = 1000;
  frame.source_isocentre_mm.reset();
  const DicomGeometry geometry = dicomGeometry(header(), frame);
  EXPECT_DOUBLE_EQ(*geometry.source_isocentre_mm.value, 800);
  EXPECT_TRUE(geometry.source_isocentre_mm.estimate);
}

TEST(DicomGeometryTest, ContradictionsAreSaid) {
  DicomFrame frame = wholeFrame();
  frame.magnification = 1.5;
  frame.field_mm = {400.0 * 0.5, 512.0 * 0.6};
  const DicomGeometry geometry = dicomGeometry(header(), frame);
  ASSERT_EQ(geometry.warnings.size(), 2U);
  EXPECT_NE(geometry.warnings[0].find("(0018,1114)"), std::string::npos);
  EXPECT_NE(geometry.warnings[1].find("(0018,1149)"), std::string::npos);
  frame = wholeFrame();
  frame.source_isocentre_mm = 1100;
  EXPECT_NE(dicomGeometry(header(), frame).warnings.at(0).find("behind the detector"), std::string::npos);
}

TEST(DicomGeometryTest, APixelIsElementsOrAShareOfTheField) {
  DicomFrame frame = wholeFrame();
  frame.imager_spacing_mm.reset();
  frame.element_spacing_mm = RowColumn{0.2, 0.2};
  frame.element_binning = RowColumn{2, 2};
  auto pixel = dicomGeometry(header(), frame).pixel_mm;
  EXPECT_EQ(pixel.value, (RowColumn{0.4, 0.4}));
  EXPECT_FALSE(pixel.estimate);
  // Not binned, for all that one knows: the field says more.
  frame.element_binning.reset();
  frame.field_mm = {200, 256};
  pixel = dicomGeometry(header(), frame).pixel_mm;
  EXPECT_EQ(pixel.value, (RowColumn{0.5, 0.5}));
  EXPECT_TRUE(pixel.estimate);
  frame = wholeFrame();
  frame.imager_spacing_mm.reset();
  frame.intensifier_mm = 240;
  const DicomGeometry geometry = dicomGeometry(header(), frame);
  EXPECT_EQ(geometry.pixel_mm.value, (RowColumn{0.6, 0.6}));  // Over the smaller side.
  ASSERT_EQ(geometry.warnings.size(), 1U);
  EXPECT_NE(geometry.warnings.front().find("--pixel-mm"), std::string::npos);
}

TEST(DicomGeometryTest, ARadiographsPixelSpacingIsNotTheDetectors) {
  DicomFrame frame = wholeFrame();
  frame.imager_spacing_mm.reset();
  frame.pixel_spacing_mm = RowColumn{0.2, 0.2};
  EXPECT_EQ(remedies(dicomGeometry(header(), frame), false), std::vector<std::string>{"--pixel-mm"});
  frame.pixel_spacing_calibration = "GEOMETRY";
  frame.magnification = 1000.0 / 750.0;
  EXPECT_NEAR((*dicomGeometry(header(), frame).pixel_mm.value)[0], 0.2 * 1000 / 750, 1e-12);
}

TEST(DicomGeometryTest, TheMiddleOfTheDetectorIsInTheFieldsPlace) {
  DicomFrame frame = wholeFrame();
  frame.imager_spacing_mm = RowColumn{0.4, 0.4};
  frame.element_spacing_mm = RowColumn{0.2, 0.2};
  frame.detector_mm = RowColumn{300, 400};  // Its middle is at element 749.5, 999.5.
  frame.field_origin = RowColumn{100, 300};
  auto point = *dicomGeometry(header(), frame).principal_point_px.value;
  // (750 − 100) / 2 − 0.5 rows and (1000 − 300) / 2 − 0.5 columns.
  EXPECT_NEAR(point.x(), 349.5, 1e-9);
  EXPECT_NEAR(point.y(), 324.5, 1e-9);
  // Stored turned by a quarter: what was on the left is on top, what was below on the left.
  frame.field_rotation_deg = 90;
  point = *dicomGeometry(header(400, 512), frame).principal_point_px.value;
  EXPECT_NEAR(point.x(), 399 - 324.5, 1e-9);
  EXPECT_NEAR(point.y(), 349.5, 1e-9);
  frame.field_flipped = true;
  point = *dicomGeometry(header(400, 512), frame).principal_point_px.value;
  EXPECT_NEAR(point.x(), 324.5, 1e-9);
}

TEST(DicomGeometryTest, TheIsocentresProjectionIsThePrincipalPoint) {
  DicomFrame frame = wholeFrame();
  frame.imager_spacing_mm = RowColumn{0.2, 0.2};
  frame.element_spacing_mm = RowColumn{0.2, 0.2};
  frame.field_origin = RowColumn{10, 20};
  frame.isocentre_on_detector = RowColumn{200, 300};
  const auto point = dicomGeometry(header(), frame).principal_point_px;
  EXPECT_NEAR(point.value->x(), 280, 1e-9);
  EXPECT_NEAR(point.value->y(), 190, 1e-9);
  EXPECT_NE(point.source.find("(0018,9430)"), std::string::npos);
}

TEST(DicomGeometryTest, ATiltedDetectorNeedsAPerson) {
  DicomFrame frame = wholeFrame();
  frame.detector_primary_deg = 4;
  EXPECT_FALSE(dicomGeometry(header(), frame).camera);
  EXPECT_EQ(remedies(dicomGeometry(header(), frame), false), std::vector<std::string>{"--principal-point-px"});
  GivenGeometry given;
  given.principal_point_px = Eigen::Vector2d(255, 200);
  EXPECT_TRUE(dicomGeometry(header(), frame, given).camera);
}

TEST(DicomGeometryTest, ARadiographsViewAndAxesSayWhetherItIsMirrored) {
  DicomFrame frame;
  frame.view_position = "AP";
  EXPECT_TRUE(dicomGeometry(header(), frame).mirrored.estimate);  // Either side may be on the left.
  frame.patient_orientation = {"R", "F"};
  EXPECT_TRUE(*dicomGeometry(header(), frame).mirrored.value);
  frame.patient_orientation = {"L", "F"};
  EXPECT_FALSE(*dicomGeometry(header(), frame).mirrored.value);
  frame.view_position = "PA";
  EXPECT_TRUE(*dicomGeometry(header(), frame).mirrored.value);
}

}  // namespace
}  // namespace xray_registration
