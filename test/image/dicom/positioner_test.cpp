#include "image/dicom/positioner.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

using Eigen::Vector3d;

const Vector3d kLeft(1, 0, 0), kBack(0, 1, 0), kHead(0, 0, 1);
constexpr double kRounding = 1e-12;

void expectAxes(const PositionerAxes& axes, const Vector3d& beam, const Vector3d& columns, const Vector3d& rows) {
  EXPECT_LT((axes.beam - beam).norm(), kRounding) << axes.beam.transpose();
  EXPECT_LT((axes.columns - columns).norm(), kRounding) << axes.columns.transpose();
  EXPECT_LT((axes.rows - rows).norm(), kRounding) << axes.rows.transpose();
}

TEST(PositionerTest, TheStandardsDirections) {
  // C.8.7.5.1.2: the patient faces the detector at 0, 0; +90 is the patient's left side; +90 of the second is cranial.
  expectAxes(positionerAxes(0, 0), -kBack, kLeft, -kHead);
  expectAxes(positionerAxes(90, 0), kLeft, kBack, -kHead);
  expectAxes(positionerAxes(-90, 0), -kLeft, -kBack, -kHead);
  expectAxes(positionerAxes(180, 0), kBack, -kLeft, -kHead);
  expectAxes(positionerAxes(0, 90), kHead, kLeft, -kBack);
  expectAxes(positionerAxes(0, -90), -kHead, kLeft, kBack);
}

TEST(PositionerTest, InLaoTheSpineIsOnTheRight) {
  // As every angiographer knows; the spine lies behind the isocentre.
  EXPECT_GT(positionerAxes(40, 0).columns.dot(kBack), 0.5);
  EXPECT_LT(positionerAxes(-40, 0).columns.dot(kBack), -0.5);
}

TEST(PositionerTest, AxesAreUnitVectorsAtRightAnglesAndSeenFromTheDetector) {
  for (const double primary : {-140.0, -30.0, 0.0, 75.0}) {
    for (const double secondary : {-60.0, 0.0, 25.0}) {
      const PositionerAxes axes = positionerAxes(primary, secondary);
      EXPECT_LT((axes.columns.cross(axes.rows) + axes.beam).norm(), kRounding) << primary << ", " << secondary;
      EXPECT_NEAR(axes.columns.norm(), 1.0, kRounding);
    }
  }
}

TEST(PositionerTest, TheFieldIsTurnedClockwiseThenFlipped) {
  const PositionerAxes axes = positionerAxes(0, 0);
  // What was on top, the head, is on the right after a quarter turn, below after two, on the left after three.
  expectAxes(dicom::storedAxes(axes, 90, false), -kBack, kHead, kLeft);
  expectAxes(dicom::storedAxes(axes, 180, false), -kBack, -kLeft, kHead);
  expectAxes(dicom::storedAxes(axes, 270, false), -kBack, -kHead, -kLeft);
  expectAxes(dicom::storedAxes(axes, 90, true), -kBack, -kHead, kLeft);
}

TEST(PositionerTest, WordsForTheAxesAreFollowed) {
  const PositionerAxes ap = positionerAxes(180, 0);
  expectAxes(*dicom::axesAlong(ap, {"L", "F"}), kBack, kLeft, -kHead);
  expectAxes(*dicom::axesAlong(ap, {"R", "F"}), kBack, -kLeft, -kHead);
  expectAxes(*dicom::axesAlong(ap, {"H", "L"}), kBack, kHead, kLeft);
  // Of an oblique picture the nearest.
  const PositionerAxes oblique = positionerAxes(30, 0);
  expectAxes(*dicom::axesAlong(oblique, {"LP", "F"}), oblique.beam, oblique.columns, oblique.rows);
}

TEST(PositionerTest, WordsThatFitNothingAreNotFollowed) {
  const PositionerAxes pa = positionerAxes(0, 0);
  EXPECT_FALSE(dicom::axesAlong(pa, {"A", "F"}));
  EXPECT_FALSE(dicom::axesAlong(pa, {"L"}));
  EXPECT_FALSE(dicom::axesAlong(pa, {"", ""}));
  EXPECT_FALSE(dicom::axesAlong(pa, {"QQ", "F"}));
}

}  // namespace
}  // namespace xray_registration
