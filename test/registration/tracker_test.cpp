#include "xray_registration/registration/tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace xray_registration {
namespace {

// Poses are composed in double from values up to 1e3 mm.
constexpr double kRoundingMm = 1e-9;

const Eigen::Vector3d kCentreCt(10.0, -20.0, 30.0);

/// Answers what the test has prepared and remembers what it was asked.
class ScriptedRegistrar : public Registrar {
 public:
  void setVolume(const AttenuationVolume&) override {}
  bool hasVolume() const override { return true; }
  RegistrationResult registerFrame(const std::vector<ViewInput>&, const RigidTransform& T_camera_ct_start,
                                   bool tracking) override {
    start = T_camera_ct_start;
    was_tracking = tracking;
    ++calls;
    RegistrationResult result;
    result.T_camera_ct = answer;
    result.accepted = accept;
    if (!accept) result.reason = "not convincing";
    return result;
  }
  FloatImage renderDrr(const XrayCamera&, const RigidTransform&) override { return {}; }
  Eigen::Vector3d centreCt() const override { return kCentreCt; }
  std::string deviceName() const override { return "none"; }
  std::size_t deviceBytes() const override { return 0; }

  RigidTransform answer = RigidTransform::Identity();
  bool accept = true;
  RigidTransform start = RigidTransform::Identity();
  bool was_tracking = false;
  int calls = 0;
};

RigidTransform poseAt(double x_mm) {
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() = rotationFromVector(Eigen::Vector3d(0.3, -0.2, 1.0));
  T_camera_ct.translation() = Eigen::Vector3d(x_mm, 5.0, 900.0);
  return T_camera_ct;
}

double distanceMm(const RigidTransform& a, const RigidTransform& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

class TrackerTest : public ::testing::Test {
 protected:
  RegistrationResult accepted(const RigidTransform& answer, double stamp_s) {
    registrar.accept = true;
    registrar.answer = answer;
    return tracker.process(&registrar, views, stamp_s);
  }
  RegistrationResult refused(double stamp_s) {
    registrar.accept = false;
    registrar.answer = poseAt(777.0);
    return tracker.process(&registrar, views, stamp_s);
  }

  ScriptedRegistrar registrar;
  TrackerOptions options;
  Tracker tracker{options};
  std::vector<ViewInput> views{XrayFrame{}};
};

TEST_F(TrackerTest, WaitsForAPose) {
  EXPECT_EQ(tracker.state(), TrackingState::kWaitingForPose);
  EXPECT_FALSE(tracker.prediction(1.0).has_value());
  const RegistrationResult result = accepted(poseAt(0.0), 1.0);
  EXPECT_FALSE(result.accepted);
  EXPECT_FALSE(result.reason.empty());
  EXPECT_EQ(registrar.calls, 0);
}

TEST_F(TrackerTest, StartsFromTheGivenPoseUntilAFrameIsAccepted) {
  tracker.setPose(poseAt(3.0));
  EXPECT_EQ(tracker.state(), TrackingState::kWaitingForPose);
  for (int i = 0; i < 3; ++i) {
    const RegistrationResult result = refused(1.0 + i);
    EXPECT_EQ(result.reason, "not convincing");
    EXPECT_LT(distanceMm(registrar.start, poseAt(3.0)), kRoundingMm);
    EXPECT_FALSE(registrar.was_tracking);
  }
  accepted(poseAt(4.0), 5.0);
  EXPECT_LT(distanceMm(registrar.start, poseAt(3.0)), kRoundingMm);
  EXPECT_EQ(tracker.state(), TrackingState::kTracking);
  EXPECT_EQ(tracker.refusedInARow(), 0);
}

TEST_F(TrackerTest, SecondFrameStartsWhereTheFirstWasFound) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(2.0), 1.0);
  accepted(poseAt(4.0), 1.1);
  EXPECT_LT(distanceMm(registrar.start, poseAt(2.0)), kRoundingMm);
  EXPECT_TRUE(registrar.was_tracking);
}

TEST_F(TrackerTest, PredictsWithConstantVelocity) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(2.0), 1.0);
  accepted(poseAt(4.0), 1.1);
  EXPECT_LT(distanceMm(*tracker.prediction(1.2), poseAt(6.0)), kRoundingMm);
  EXPECT_LT(distanceMm(*tracker.prediction(1.15), poseAt(5.0)), kRoundingMm);
}

TEST_F(TrackerTest, PredictsRotationAboutTheCtCentre) {
  Twist step = Twist::Zero();
  step << 1.0, 0.0, 0.5, 0.02, 0.03, -0.01;
  const RigidTransform first = poseAt(0.0);
  const RigidTransform second = updatedPose(first, step, first * kCentreCt);
  const RigidTransform third = updatedPose(second, step, second * kCentreCt);
  tracker.setPose(first);
  accepted(first, 1.0);
  accepted(second, 1.1);
  EXPECT_LT(distanceMm(*tracker.prediction(1.2), third), kRoundingMm);
}

TEST_F(TrackerTest, VelocityIsBounded) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  accepted(poseAt(100.0), 1.1);  // 1000 mm/s
  const double moved_mm = tracker.prediction(1.2)->translation().x() - 100.0;
  EXPECT_NEAR(moved_mm, options.max_velocity_mm_s * 0.1, kRoundingMm);

  RigidTransform turned = poseAt(100.0);
  Twist step = Twist::Zero();
  step(5) = 1.0;  // 10 rad/s
  turned = updatedPose(turned, step, turned * kCentreCt);
  tracker.setPose(poseAt(100.0));
  accepted(poseAt(100.0), 2.0);
  accepted(turned, 2.1);
  // The angle of a rotation matrix in double, near 0.2 rad.
  EXPECT_NEAR(rotationAngleBetween(*tracker.prediction(2.2), turned), options.max_velocity_rad_s * 0.1, 1e-9);
}

TEST_F(TrackerTest, VelocityIsNotTrustedOverAGapOrBackInTime) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  accepted(poseAt(2.0), 1.1);
  EXPECT_LT(distanceMm(*tracker.prediction(1.1 + options.max_prediction_gap_s + 0.01), poseAt(2.0)), kRoundingMm);
  EXPECT_LT(distanceMm(*tracker.prediction(1.1), poseAt(2.0)), kRoundingMm);
  EXPECT_LT(distanceMm(*tracker.prediction(0.5), poseAt(2.0)), kRoundingMm);
  // Two neighbours too far apart in time say nothing about velocity.
  accepted(poseAt(4.0), 9.0);
  EXPECT_LT(distanceMm(*tracker.prediction(9.1), poseAt(4.0)), kRoundingMm);
}

TEST_F(TrackerTest, EqualStampsDoNotDivideByZero) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  accepted(poseAt(2.0), 1.0);
  ASSERT_TRUE(tracker.prediction(1.1)->matrix().allFinite());
  EXPECT_LT(distanceMm(*tracker.prediction(1.1), poseAt(2.0)), kRoundingMm);
}

TEST_F(TrackerTest, ARefusedFrameMovesNothing) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  accepted(poseAt(2.0), 1.1);
  refused(1.2);
  EXPECT_EQ(tracker.state(), TrackingState::kTracking);
  EXPECT_EQ(tracker.refusedInARow(), 1);
  EXPECT_LT(distanceMm(*tracker.prediction(1.3), poseAt(2.0)), kRoundingMm);
}

TEST_F(TrackerTest, ARunOfRefusedFramesMakesLostAndAnAcceptedOneEndsIt) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  accepted(poseAt(2.0), 1.1);
  for (int i = 1; i < options.frames_until_lost; ++i) {
    refused(1.1 + 0.1 * i);
    EXPECT_EQ(tracker.state(), TrackingState::kTracking) << i << " refused";
  }
  refused(2.0);
  EXPECT_EQ(tracker.state(), TrackingState::kLost);
  EXPECT_FALSE(tracker.isTracking());
  // The search goes on from where the CT was last seen, and not as tracking.
  accepted(poseAt(3.0), 2.1);
  EXPECT_LT(distanceMm(registrar.start, poseAt(2.0)), kRoundingMm);
  EXPECT_FALSE(registrar.was_tracking);
  EXPECT_EQ(tracker.state(), TrackingState::kTracking);
  EXPECT_EQ(tracker.refusedInARow(), 0);
}

TEST_F(TrackerTest, FramesThatCannotBeLookedAtCountAsRefused) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  refused(1.1);
  for (int i = 2; i < options.frames_until_lost; ++i) tracker.noteUnusable();
  EXPECT_EQ(tracker.state(), TrackingState::kTracking);
  tracker.noteUnusable();
  EXPECT_EQ(tracker.state(), TrackingState::kLost);
}

TEST_F(TrackerTest, OnlyWhatIsTrackedIsLost) {
  tracker.loseTrack();
  EXPECT_EQ(tracker.state(), TrackingState::kWaitingForPose);
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  accepted(poseAt(2.0), 1.1);
  tracker.loseTrack();
  EXPECT_EQ(tracker.state(), TrackingState::kLost);
  accepted(poseAt(3.0), 1.2);
  EXPECT_FALSE(registrar.was_tracking);
  EXPECT_LT(distanceMm(registrar.start, poseAt(2.0)), kRoundingMm);  // The velocity is not trusted.
}

TEST_F(TrackerTest, AnAcceptedFrameBreaksTheRun) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  for (int round = 0; round < 3; ++round) {
    for (int i = 1; i < options.frames_until_lost; ++i) refused(2.0 + round + 0.1 * i);
    accepted(poseAt(0.0), 2.9 + round);
    EXPECT_EQ(tracker.state(), TrackingState::kTracking);
  }
}

TEST_F(TrackerTest, TheCamerasOwnMotionReplacesTheVelocity) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  accepted(poseAt(2.0), 1.1);
  RigidTransform T_camera_now_camera_last = RigidTransform::Identity();
  T_camera_now_camera_last.linear() = rotationFromVector(Eigen::Vector3d(0.0, 0.4, 0.0));
  T_camera_now_camera_last.translation() = Eigen::Vector3d(-300.0, 0.0, 90.0);
  const RigidTransform expected = T_camera_now_camera_last * poseAt(2.0);
  EXPECT_LT(distanceMm(*tracker.prediction(1.2, T_camera_now_camera_last), expected), kRoundingMm);
  registrar.answer = expected;
  tracker.process(&registrar, views, 1.2, T_camera_now_camera_last);
  EXPECT_LT(distanceMm(registrar.start, expected), kRoundingMm);
}

TEST_F(TrackerTest, AGivenPoseReplacesAllHistory) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  accepted(poseAt(2.0), 1.1);
  tracker.setPose(poseAt(50.0));
  EXPECT_FALSE(tracker.isTracking());
  EXPECT_LT(distanceMm(*tracker.prediction(1.2), poseAt(50.0)), kRoundingMm);
  accepted(poseAt(51.0), 1.2);
  EXPECT_FALSE(registrar.was_tracking);
  // One accepted frame since: no velocity yet.
  EXPECT_LT(distanceMm(*tracker.prediction(1.3), poseAt(51.0)), kRoundingMm);
}

TEST_F(TrackerTest, ResetForgets) {
  tracker.setPose(poseAt(0.0));
  accepted(poseAt(0.0), 1.0);
  tracker.reset();
  EXPECT_EQ(tracker.state(), TrackingState::kWaitingForPose);
  EXPECT_FALSE(tracker.prediction(1.1).has_value());
}

TEST(TrackingStateNames, AreThoseOfTheStatusMessage) {
  EXPECT_STREQ(toString(TrackingState::kWaitingForCt), "WAITING_FOR_CT");
  EXPECT_STREQ(toString(TrackingState::kWaitingForPose), "WAITING_FOR_POSE");
  EXPECT_STREQ(toString(TrackingState::kTracking), "TRACKING");
  EXPECT_STREQ(toString(TrackingState::kLost), "LOST");
  EXPECT_STREQ(toString(TrackingState::kFault), "FAULT");
}

}  // namespace
}  // namespace xray_registration
