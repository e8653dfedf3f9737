#include "xray_registration/pipeline/calibration_frames.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

const Eigen::Vector3d kCentreCt(5.0, 6.0, 7.0);

RigidTransform at(double x_mm) {
  RigidTransform pose = RigidTransform::Identity();
  pose.translation() = Eigen::Vector3d(x_mm, 0.0, 800.0);
  return pose;
}

/// A frame that is known by its only view's name.
CalibrationFrames::Views named(const std::string& name) {
  return [name] {
    RawView view;
    view.name = name;
    return std::vector<RawView>{view};
  };
}

TEST(MostDifferentTest, ChoosesTheFarthestEachTime) {
  const std::vector<RigidTransform> poses = {at(0.0), at(1.0), at(10.0), at(4.0)};
  EXPECT_EQ(mostDifferent(poses, kCentreCt, 2), (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(mostDifferent(poses, kCentreCt, 3), (std::vector<std::size_t>{0, 2, 3}));
  EXPECT_EQ(mostDifferent(poses, kCentreCt, 9).size(), 4U);
  EXPECT_TRUE(mostDifferent({}, kCentreCt, 3).empty());
}

TEST(CalibrationFramesTest, KeepsTheNewestAndTheMostDifferent) {
  CalibrationFrames frames(2);
  frames.add(named("near"), at(0.0), kCentreCt);
  frames.add(named("far"), at(20.0), kCentreCt);
  frames.add(named("newest"), at(1.0), kCentreCt);
  EXPECT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames.told().front().name, "newest");
  frames.add(named("last"), at(19.0), kCentreCt);  // "newest" is farther from it than "far".
  EXPECT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames.told().front().name, "last");
  frames.forget();
  EXPECT_EQ(frames.size(), 0U);
}

TEST(CalibrationFramesTest, WithoutFramesThereIsNothingToCalibrateWith) {
  CalibrationFrames none(0);
  none.add(named("one"), at(0.0), kCentreCt);
  EXPECT_EQ(none.size(), 0U);
  EXPECT_THROW(none.calibrate(nullptr, ImageParameters{}, {}), std::invalid_argument);
}

TEST(CorrectedTest, ShiftsCountInPixelsOfTheImageAndKInThoseOfTheSensor) {
  Calibration told;
  told.k = {1000.0, 0.0, 255.5, 0.0, 900.0, 127.5, 0.0, 0.0, 1.0};
  told.binning_x = told.binning_y = 2;
  ViewGeometry geometry;
  geometry.focal_scale = 1.02;
  geometry.centre_shift_px = {3.0, -1.0};
  const Calibration straight = corrected(told, geometry);
  EXPECT_DOUBLE_EQ(straight.k[0], 1020.0);
  EXPECT_DOUBLE_EQ(straight.k[4], 918.0);
  EXPECT_DOUBLE_EQ(straight.k[2], 261.5);
  EXPECT_DOUBLE_EQ(straight.k[5], 125.5);
  EXPECT_TRUE(straight.distortion.empty());
  geometry.radial = 0.3;
  const Calibration distorted = corrected(told, geometry);
  EXPECT_EQ(distorted.distortion_model, "plumb_bob");
  ASSERT_EQ(distorted.distortion.size(), 5U);
  EXPECT_DOUBLE_EQ(distorted.distortion[0], 0.3);
}

TEST(CorrectedTest, AViewThatCannotBeUsedIsSaid) {
  FrameMaker maker(ImageParameters{}, {"ap"});
  RawView broken;
  broken.name = "ap";
  broken.problem = "no image came";
  try {
    correctedViews({broken}, {ViewGeometry{}}, &maker);
    FAIL() << "nothing was thrown";
  } catch (const FrameError& error) {
    EXPECT_NE(std::string(error.what()).find("no image came"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace xray_registration
