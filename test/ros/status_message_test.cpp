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

}  // namespace
}  // namespace xray_registration
