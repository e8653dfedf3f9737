#include "xray_registration/image/landmark_pose.h"

#include <gtest/gtest.h>

#include <random>

namespace xray_registration {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

XrayCamera camera() {
  XrayCamera camera;
  camera.width = 1024;
  camera.height = 1024;
  camera.fx = camera.fy = 4000;
  camera.cx = camera.cy = 511.5;
  return camera;
}

RigidTransform truth() {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector({1.4, 0.3, -0.2});
  pose.translation() << 12, -8, 760;
  return pose;
}

/// Places on a skull, mm.
std::vector<Eigen::Vector3d> skull() {
  return {{0, -90, 10}, {-45, -60, 25}, {48, -62, 22}, {-70, 5, -10},
          {72, 8, -14}, {3, 85, 30},    {5, -10, 95},  {-20, -70, -55}};
}

/// The first `count` places, as `view` sees them, clicked `noise_px` off (one standard deviation, each axis).
std::vector<Landmark> seen(std::size_t count, double noise_px = 0.0, const LandmarkView& view = {camera()},
                           std::size_t number = 0, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<Landmark> landmarks;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d point = skull()[i];
    const Eigen::Vector2d pixel = view.camera.project(view.T_view_first * (truth() * point));
    landmarks.push_back({"p" + std::to_string(i), point, pixel, number});
    landmarks.back().pixel += noise_px * Eigen::Vector2d(noise(random), noise(random));
  }
  return landmarks;
}

/// A second view, turned by 70° about the CT.
LandmarkView sideView() {
  RigidTransform around = RigidTransform::Identity();
  around.linear() = rotationFromVector({0, 70 * kDegree, 0});
  const Eigen::Translation3d to_middle(0, 0, 760);
  return {camera(), RigidTransform(to_middle * around * to_middle.inverse())};
}

std::string refusal(const std::vector<Landmark>& landmarks, const std::vector<LandmarkView>& views = {{camera()}}) {
  try {
    poseFromLandmarks(landmarks, views);
  } catch (const LandmarkError& error) {
    return error.what();
  }
  return "";
}

double errorMm(const LandmarkPose& pose) {
  double worst = 0.0;
  for (const auto& point : skull()) worst = std::max(worst, (pose.T_first_ct * point - truth() * point).norm());
  return worst;
}

TEST(LandmarkPoseTest, ExactPointsGiveTheExactPose) {
  for (std::size_t count = 4; count <= 8; ++count) {
    const LandmarkPose pose = poseFromLandmarks(seen(count), {{camera()}});
    EXPECT_LT(errorMm(pose), 1e-4) << count << " points";
    EXPECT_EQ(pose.usedCount(), count);
    EXPECT_LT(pose.rms_px, 1e-5);
  }
}

TEST(LandmarkPoseTest, ClicksThatAreOffGiveAStart) {
  // A start has to be good to 15° and 25 mm.
  for (unsigned seed = 0; seed < 10; ++seed) {
    const LandmarkPose pose = poseFromLandmarks(seen(8, 1.5, {camera()}, 0, seed), {{camera()}});
    EXPECT_LT(rotationAngleBetween(pose.T_first_ct, truth()), 5 * kDegree) << seed;
    EXPECT_LT(errorMm(pose), 25.0) << seed;
    EXPECT_GT(pose.rms_px, 0.1);
  }
}

TEST(LandmarkPoseTest, WrongPairsAreFoundAndLeftOut) {
  auto landmarks = seen(8, 0.5);
  std::swap(landmarks[1].pixel, landmarks[4].pixel);
  const LandmarkPose pose = poseFromLandmarks(landmarks, {{camera()}});
  EXPECT_EQ(pose.used, (std::vector<bool>{true, false, true, true, false, true, true, true}));
  EXPECT_GT(pose.residual_px[1], 100);
  EXPECT_LT(errorMm(pose), 10.0);
}

TEST(LandmarkPoseTest, TheFourthPointChecksTheOthers) {
  auto landmarks = seen(4);
  landmarks[3].pixel.x() += 80;
  EXPECT_NE(refusal(landmarks).find("of 4 points agree"), std::string::npos) << refusal(landmarks);
}

TEST(LandmarkPoseTest, TooFewAreRefused) {
  EXPECT_NE(refusal(seen(3)).find("3 points are too few: a view needs four"), std::string::npos);
  EXPECT_NE(refusal({}).find("too few"), std::string::npos);
}

TEST(LandmarkPoseTest, PointsOnALineAreRefused) {
  std::vector<Landmark> landmarks;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d point(10.0 * i, 5.0 * i + 0.1 * (i % 2), 20.0);
    landmarks.push_back({"", point, camera().project(truth() * point), 0});
  }
  EXPECT_NE(refusal(landmarks).find("on a line"), std::string::npos);
}

TEST(LandmarkPoseTest, PointsThatCoincideAreRefusedByName) {
  auto landmarks = seen(6);
  landmarks[5].point_ct = landmarks[2].point_ct;
  EXPECT_NE(refusal(landmarks).find("'p2' and point 'p5' are the same point"), std::string::npos);
  landmarks = seen(6);
  landmarks[5].pixel = landmarks[2].pixel;
  EXPECT_NE(refusal(landmarks).find("same pixel"), std::string::npos);
}

TEST(LandmarkPoseTest, AMirroredPictureIsToldApart) {
  for (const std::size_t count : {4U, 7U, 8U}) {
    auto landmarks = seen(count, 0.3);
    for (Landmark& landmark : landmarks) landmark.pixel.x() = 1023 - landmark.pixel.x();
    EXPECT_NE(refusal(landmarks).find("mirror image"), std::string::npos) << count << ": " << refusal(landmarks);
  }
}

TEST(LandmarkPoseTest, AMirroredPictureThatFitsNearlyIsToldApart) {
  // In a narrow beam and few pixels, depth makes a difference of a pixel or two only.
  XrayCamera small = camera().binned(8);
  auto landmarks = seen(8, 0.0, {small});
  for (Landmark& landmark : landmarks) landmark.pixel.x() = small.width - 1 - landmark.pixel.x();
  EXPECT_NE(refusal(landmarks, {{small}}).find("mirror image"), std::string::npos) << refusal(landmarks, {{small}});
  for (unsigned seed = 0; seed < 10; ++seed) {
    EXPECT_EQ(refusal(seen(8, 0.5, {small}, 0, seed), {{small}}), "") << seed;
    EXPECT_EQ(refusal(seen(4, 0.5, {small}, 0, seed), {{small}}), "") << seed;
  }
}

TEST(LandmarkPoseTest, TwoPosesThatFitAlikeAreRefused) {
  // Four points in a small plane: whether its left or its right side is nearer makes no visible difference.
  std::vector<Landmark> landmarks;
  for (const auto& point : {Eigen::Vector3d(-20, -15, 0), {20, -15, 0}, {20, 15, 0}, {-20, 15, 0}}) {
    RigidTransform pose = RigidTransform::Identity();
    pose.linear() = rotationFromVector({0, 25 * kDegree, 0});
    pose.translation() << 0, 0, 760;
    landmarks.push_back({"", point, camera().binned(4).project(pose * point), 0});
    landmarks.back().pixel += Eigen::Vector2d(0.3 * (landmarks.size() % 2), -0.2);
  }
  EXPECT_NE(refusal(landmarks, {{camera().binned(4)}}).find("two different poses"), std::string::npos)
      << refusal(landmarks, {{camera().binned(4)}});
}

TEST(LandmarkPoseTest, TwoViewsSeeTheDepth) {
  const std::vector<LandmarkView> views = {{camera()}, sideView()};
  for (unsigned seed = 0; seed < 10; ++seed) {
    auto landmarks = seen(6, 1.5, views[0], 0, seed);
    const auto others = seen(6, 1.5, views[1], 1, seed + 100);
    landmarks.insert(landmarks.end(), others.begin(), others.end());
    // 1.5 px are 0.3 mm at the CT, across each of two views at 70°.
    EXPECT_LT(errorMm(poseFromLandmarks(landmarks, views)), 2.0) << seed;
  }
}

TEST(LandmarkPoseTest, ThreePointsThatTwoViewsSeeAreEnough) {
  const std::vector<LandmarkView> views = {{camera()}, sideView()};
  auto landmarks = seen(3, 0.0, views[0], 0);
  const auto others = seen(3, 0.0, views[1], 1);
  landmarks.insert(landmarks.end(), others.begin(), others.end());
  EXPECT_LT(errorMm(poseFromLandmarks(landmarks, views)), 1e-4);
  // Without names nobody knows that they are the same.
  for (Landmark& landmark : landmarks) landmark.name.clear();
  EXPECT_NE(refusal(landmarks, views), "");
}

TEST(LandmarkPoseTest, OneNameIsOnePoint) {
  const std::vector<LandmarkView> views = {{camera()}, sideView()};
  auto landmarks = seen(4, 0.0, views[0], 0);
  const auto others = seen(4, 0.0, views[1], 1);
  landmarks.insert(landmarks.end(), others.begin(), others.end());
  landmarks[6].point_ct.x() += 20;
  EXPECT_NE(refusal(landmarks, views).find("one name for two points"), std::string::npos);
}

TEST(LandmarkPoseTest, TheLimitIsTheCallers) {
  auto landmarks = seen(8);
  landmarks[2].pixel.x() += 6;
  EXPECT_EQ(poseFromLandmarks(landmarks, {{camera()}}).usedCount(), 8U);  // Within 1 % of the width.
  LandmarkOptions strict;
  strict.inlier_px = 2.0;
  const LandmarkPose pose = poseFromLandmarks(landmarks, {{camera()}}, strict);
  EXPECT_FALSE(pose.used[2]);
  EXPECT_LT(errorMm(pose), 1e-4);
}

TEST(LandmarkPoseTest, NonsenseIsThrownBack) {
  auto landmarks = seen(6);
  landmarks[3].view = 1;
  EXPECT_THROW(poseFromLandmarks(landmarks, {{camera()}}), std::invalid_argument);
  landmarks = seen(6);
  landmarks[0].pixel.x() = std::nan("");
  EXPECT_THROW(poseFromLandmarks(landmarks, {{camera()}}), std::invalid_argument);
}

}  // namespace
}  // namespace xray_registration
