#include "xray_registration/ros/status_message.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

/// No two fields alike.
FrameOutcome outcome() {
  FrameOutcome outcome;
  outcome.registered = true;
  outcome.state = TrackingState::kLost;
  outcome.views_used = {"ap"};
  outcome.views_missing = {"lateral"};
  RegistrationResult& result = outcome.result;
  result.reason = "why";
  result.converged = true;
  result.T_camera_ct.translation() = Eigen::Vector3d(100.0, -200.0, 800.0);
  result.iterations = 12;
  result.similarity = 0.5;
  result.residual = 0.25;
  result.inlier_fraction = 0.75;
  result.condition_number = 4000.0;
  result.solve_ms = 8.0;
  result.upload_ms = 2.0;
  return outcome;
}

TEST(StatusMessage, TellsWhatTheOutcomeTells) {
  std_msgs::Header header;
  header.frame_id = "ap_xray_optical";
  header.stamp.fromSec(12.5);
  const RegistrationStatus message = statusMessage(outcome(), header);
  EXPECT_EQ(message.header.frame_id, "ap_xray_optical");
  EXPECT_EQ(message.header.stamp, header.stamp);
  EXPECT_EQ(message.state, RegistrationStatus::LOST);
  EXPECT_FALSE(message.accepted);
  EXPECT_EQ(message.reason, "why");
  EXPECT_EQ(message.views_used, std::vector<std::string>{"ap"});
  EXPECT_EQ(message.views_missing, std::vector<std::string>{"lateral"});
  EXPECT_TRUE(message.converged);
  EXPECT_EQ(message.iterations, 12U);
  EXPECT_EQ(message.similarity, 0.5);
  EXPECT_EQ(message.residual, 0.25);
  EXPECT_EQ(message.inlier_fraction, 0.75);
  EXPECT_EQ(message.condition_number, 4000.0);
  EXPECT_TRUE(message.registered);
  EXPECT_DOUBLE_EQ(message.pose.position.x, 0.1);
  EXPECT_DOUBLE_EQ(message.pose.position.y, -0.2);
  EXPECT_DOUBLE_EQ(message.pose.position.z, 0.8);
  EXPECT_EQ(message.pose.orientation.w, 1.0);
  EXPECT_DOUBLE_EQ(message.solve_time, 0.008);
  EXPECT_DOUBLE_EQ(message.upload_time, 0.002);
}

TEST(StatusMessage, AFrameThatWasNotRegisteredHasNeitherPoseNorViews) {
  FrameOutcome refused = outcome();
  refused.registered = false;
  const RegistrationStatus message = statusMessage(refused, {});
  EXPECT_FALSE(message.registered);
  EXPECT_TRUE(message.views_used.empty());
  EXPECT_EQ(message.pose.position.z, 0.0);
  EXPECT_EQ(message.pose.orientation.w, 1.0);
  EXPECT_EQ(message.reason, "why");
}

BodyParameters configured(const std::string& name) {
  BodyParameters body;
  body.name = name;
  body.frame = name + "_frame";
  return body;
}

BodyResult found(const std::string& name) {
  BodyResult body;
  body.name = name;
  body.solved = true;
  body.accepted = true;
  body.similarity = 0.6;
  body.inlier_fraction = 0.7;
  body.iterations = 9;
  body.T_camera_body.translation() = Eigen::Vector3d(10.0, 20.0, 700.0);
  return body;
}

TEST(StatusMessage, BodiesStandInTheOrderOfTheConfiguration) {
  FrameOutcome frame = outcome();
  frame.result.accepted = true;
  BodyResult refused = found("T12");
  refused.accepted = false;
  refused.reason = "T12 left the image";
  frame.result.bodies = {refused, found("T11")};
  const RegistrationStatus message = statusMessage(frame, {}, {configured("T11"), configured("T12")});
  ASSERT_EQ(message.bodies.size(), 2U);
  const BodyStatus& first = message.bodies[0];
  EXPECT_EQ(first.name, "T11");
  EXPECT_EQ(first.frame, "T11_frame");
  EXPECT_TRUE(first.accepted);
  EXPECT_EQ(first.reason, "");
  EXPECT_TRUE(first.solved);
  EXPECT_EQ(first.similarity, 0.6);
  EXPECT_EQ(first.inlier_fraction, 0.7);
  EXPECT_EQ(first.iterations, 9U);
  EXPECT_DOUBLE_EQ(first.pose.position.x, 0.01);
  EXPECT_DOUBLE_EQ(first.pose.position.z, 0.7);
  EXPECT_EQ(message.bodies[1].name, "T12");
  EXPECT_FALSE(message.bodies[1].accepted);
  EXPECT_EQ(message.bodies[1].reason, "T12 left the image");
  EXPECT_DOUBLE_EQ(message.bodies[1].pose.position.z, 0.7);  // As found.
}

TEST(StatusMessage, ABodyWhoseCtWasRefusedHasAnEntryToo) {
  const RegistrationStatus message = statusMessage(outcome(), {}, {configured("T11")});
  ASSERT_EQ(message.bodies.size(), 1U);
  EXPECT_EQ(message.bodies[0].name, "T11");
  EXPECT_FALSE(message.bodies[0].accepted);
  EXPECT_FALSE(message.bodies[0].solved);
  EXPECT_EQ(message.bodies[0].reason, "the CT around it was not accepted");
  EXPECT_EQ(message.bodies[0].pose.orientation.w, 1.0);
}

TEST(StatusMessage, ABodyOfAFrameThatWasNotLookedAtHasTheFramesReason) {
  FrameOutcome refused = outcome();
  refused.registered = false;
  const RegistrationStatus message = statusMessage(refused, {}, {configured("T11")});
  ASSERT_EQ(message.bodies.size(), 1U);
  EXPECT_EQ(message.bodies[0].reason, "why");
  EXPECT_EQ(message.bodies[0].pose.position.z, 0.0);
}

}  // namespace
}  // namespace xray_registration
