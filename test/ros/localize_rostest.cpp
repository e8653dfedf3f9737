// The action ~localize with real goals, and a node that finds back by itself. Each case runs by itself, in any order.
#include <actionlib/client/simple_action_client.h>
#include <gtest/gtest.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <xray_registration/LocalizeAction.h>

#include <cmath>
#include <limits>
#include <memory>

#include "node_probe.h"

namespace xray_registration {
namespace {

using Client = actionlib::SimpleActionClient<LocalizeAction>;
using State = actionlib::SimpleClientGoalState;

const char* const kFrame = "xray_optical";

class Localize : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<Scene>("localize");
    probe_ = std::make_unique<NodeProbe>("registration", std::vector<std::string>{""});
    client_ = std::make_unique<Client>("registration/localize", false);
    ASSERT_TRUE(probe_->connected());
    ASSERT_TRUE(waitFor([] { return client_->isServerConnected(); }));
    ASSERT_TRUE(probe_->loadCt(scene_->ctPath()).success);
  }
  static void TearDownTestSuite() {
    client_.reset();
    probe_.reset();
    scene_.reset();
  }
  void SetUp() override { ASSERT_TRUE(probe_->trigger("reset")); }

  static RegistrationStatus send(const RigidTransform& T_camera_ct) {
    const sensor_msgs::Image image = scene_->image(T_camera_ct, ros::Time::now(), kFrame);
    probe_->publish(image, scene_->info(image.header));
    return probe_->answer(image.header.stamp);
  }
  static RegistrationStatus sendBlack() {
    sensor_msgs::Image image = scene_->image(scene_->pose(0), ros::Time::now(), kFrame);
    std::fill(image.data.begin(), image.data.end(), std::uint8_t{0});
    static std::size_t blacks = 0;
    image.data[2 * blacks++] = 1;  // The same picture again would be one that is held.
    probe_->publish(image, scene_->info(image.header));
    return probe_->answer(image.header.stamp);
  }

  static RigidTransform off(const RigidTransform& T_camera_ct, const Eigen::Vector3d& mm, const Eigen::Vector3d& rad) {
    Twist twist;
    twist << mm, rad;
    return updatedPose(T_camera_ct, twist, T_camera_ct * scene_->centreCt());
  }

  static LocalizeGoal goalAround(const RigidTransform& centre) {
    LocalizeGoal goal;
    goal.centre.header.frame_id = kFrame;
    goal.centre.pose = toPose(centre);
    goal.rotation = 1.0;
    goal.translation = 0.1;
    return goal;
  }

  static State ask(const LocalizeGoal& goal) {
    client_->sendGoal(goal);
    waitFor([] { return client_->getState().isDone(); }, 60.0);
    return client_->getState();
  }

  static void expectFound(const State& state, const RigidTransform& truth) {
    ASSERT_EQ(state, State::SUCCEEDED) << state.getText();
    const auto result = client_->getResult();
    EXPECT_TRUE(result->success);
    EXPECT_EQ(result->pose.header.frame_id, kFrame);
    EXPECT_GT(result->similarity, 0.8);
    const PoseError error = scene_->error(fromPose(result->pose.pose), truth);
    EXPECT_LT(error.inplane_mm, kInplaneTolerance);
    EXPECT_LT(error.mtre_mm, kMtreTolerance);
  }

  static std::unique_ptr<Scene> scene_;
  static std::unique_ptr<NodeProbe> probe_;
  static std::unique_ptr<Client> client_;
};
std::unique_ptr<Scene> Localize::scene_;
std::unique_ptr<NodeProbe> Localize::probe_;
std::unique_ptr<Client> Localize::client_;

TEST_F(Localize, FindsTheCtAroundACentreInTheNewestFrame) {
  const RigidTransform truth = scene_->pose(1);
  const RegistrationStatus waiting = send(truth);
  EXPECT_EQ(waiting.state, RegistrationStatus::WAITING_FOR_POSE);
  double last = 0.0;
  int feedbacks = 0;
  client_->sendGoal(goalAround(off(truth, {80, -60, 50}, {0.5, 0.4, -0.5})), {}, {},
                    [&](const LocalizeFeedbackConstPtr& feedback) {
                      EXPECT_GE(feedback->progress, last);
                      EXPECT_LE(feedback->progress, 1.0);
                      last = feedback->progress;
                      ++feedbacks;
                    });
  ASSERT_TRUE(waitFor([] { return client_->getState().isDone(); }, 60.0));
  expectFound(client_->getState(), truth);
  EXPECT_GT(feedbacks, 0);
  // The frame's pose is published as any other, and the next is tracked.
  EXPECT_TRUE(waitFor([&] { return !probe_->poses(waiting.header.stamp).empty(); }));
  EXPECT_EQ(probe_->transforms(waiting.header.stamp).size(), 1U);
  const RegistrationStatus next = send(scene_->pose(2));
  EXPECT_TRUE(next.accepted) << next.reason;
}

TEST_F(Localize, FindsItFromNothing) {
  const RigidTransform truth = scene_->pose(3);
  send(truth);
  expectFound(ask({}), truth);
}

TEST_F(Localize, WithoutAFrameItSaysSo) {
  const State state = ask({});
  EXPECT_EQ(state, State::ABORTED);
  EXPECT_FALSE(client_->getResult()->success);
  EXPECT_NE(client_->getResult()->message.find("no X-ray"), std::string::npos) << client_->getResult()->message;
}

TEST_F(Localize, RefusesWhatMakesNoSense) {
  send(scene_->pose(0));
  LocalizeGoal goal = goalAround(scene_->pose(0));
  goal.rotation = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(ask(goal), State::ABORTED);
  EXPECT_NE(client_->getResult()->message.find("rotation"), std::string::npos);
  goal = goalAround(scene_->pose(0));
  goal.centre.pose.orientation.w = goal.centre.pose.orientation.x = 0.0;
  goal.centre.pose.orientation.y = goal.centre.pose.orientation.z = 0.0;
  EXPECT_EQ(ask(goal), State::ABORTED);
  EXPECT_FALSE(client_->getResult()->message.empty());
  goal = goalAround(scene_->pose(0));
  goal.centre.header.frame_id = "nowhere";
  EXPECT_EQ(ask(goal), State::ABORTED);
  EXPECT_NE(client_->getResult()->message.find("nowhere"), std::string::npos) << client_->getResult()->message;
}

TEST_F(Localize, IsEndedByPreemptionAndByItsTimeLimit) {
  send(scene_->pose(0));
  client_->sendGoal(LocalizeGoal());
  ASSERT_TRUE(waitFor([] { return client_->getState() == State::ACTIVE; }));
  client_->cancelGoal();
  ASSERT_TRUE(waitFor([] { return client_->getState().isDone(); }));
  EXPECT_EQ(client_->getState(), State::PREEMPTED);
  // Nothing was found, so nothing is known.
  EXPECT_TRUE(waitFor([] { return send(scene_->pose(0)).state == RegistrationStatus::WAITING_FOR_POSE; }));

  LocalizeGoal limited;
  limited.time_limit = 1e-3;
  EXPECT_EQ(ask(limited), State::ABORTED);
  EXPECT_NE(client_->getResult()->message.find("time limit"), std::string::npos) << client_->getResult()->message;
}

TEST_F(Localize, FramesMeanwhileAreAnswered) {
  send(scene_->pose(0));
  client_->sendGoal(LocalizeGoal());
  ASSERT_TRUE(waitFor([] { return client_->getState() == State::ACTIVE; }));
  std::string reason;
  waitFor([&] {
    const RegistrationStatus status = send(scene_->pose(0));
    if (status.reason.find("~localize") != std::string::npos) reason = status.reason;
    return !reason.empty() || client_->getState().isDone();
  });
  EXPECT_FALSE(reason.empty());
  ASSERT_TRUE(waitFor([] { return client_->getState().isDone(); }, 60.0));
}

TEST_F(Localize, WhatIsLostIsFoundElsewhere) {
  send(scene_->pose(0));
  ASSERT_EQ(ask({}), State::SUCCEEDED);
  ASSERT_TRUE(send(scene_->pose(0)).accepted);
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(sendBlack().accepted);
  EXPECT_EQ(sendBlack().state, RegistrationStatus::LOST);
  // Further than a local search reaches.
  const RigidTransform elsewhere = off(scene_->pose(0), {40.0, 35.0, 0.0}, {0.0, 0.0, 0.6});
  RegistrationStatus status;
  ASSERT_TRUE(waitFor([&] { return (status = send(elsewhere)).accepted; }, 60.0)) << status.reason;
  const PoseError error = scene_->error(fromPose(status.pose), elsewhere);
  EXPECT_LT(error.inplane_mm, kInplaneTolerance) << "similarity " << status.similarity;
}

geometry_msgs::TransformStamped isocentreAt(double depth_m) {
  geometry_msgs::TransformStamped transform;
  transform.header.stamp = ros::Time::now();
  transform.header.frame_id = kFrame;
  transform.child_frame_id = "isocentre";
  transform.transform.translation.x = 0.05;  // Beside the axis, which does not matter.
  transform.transform.translation.z = depth_m;
  transform.transform.rotation.w = 1.0;
  return transform;
}

TEST(LocalizeByTf, AFrameSaysHowFarAwayTheCtIs) {
  const Scene scene("localize_by_tf");
  NodeProbe probe("isocentre/registration", {"isocentre"});
  Client client("isocentre/registration/localize", false);
  ASSERT_TRUE(probe.connected());
  ASSERT_TRUE(waitFor([&] { return client.isServerConnected(); }));
  ASSERT_TRUE(probe.loadCt(scene.ctPath()).success);
  const RigidTransform truth = scene.pose(3);
  const auto send = [&] {
    const sensor_msgs::Image image = scene.image(truth, ros::Time::now(), kFrame);
    probe.publish(image, scene.info(image.header));
    probe.answer(image.header.stamp);
  };
  send();
  const auto ask = [&client] {
    client.sendGoal(LocalizeGoal());
    EXPECT_TRUE(waitFor([&] { return client.getState().isDone(); }, 60.0));
    return client.getResult()->message;
  };
  EXPECT_NE(ask().find("isocentre"), std::string::npos) << client.getResult()->message;

  // Where the goal has a centre, the distance is known without it.
  LocalizeGoal around;
  around.centre.header.frame_id = kFrame;
  around.centre.pose = toPose(truth);
  client.sendGoal(around);
  ASSERT_TRUE(waitFor([&] { return client.getState().isDone(); }, 60.0));
  EXPECT_TRUE(client.getResult()->success) << client.getResult()->message;
  ASSERT_TRUE(probe.trigger("reset"));
  send();

  tf2_ros::StaticTransformBroadcaster broadcaster;
  broadcaster.sendTransform(isocentreAt(-1.0));
  EXPECT_TRUE(waitFor([&] { return ask().find("behind the X-ray source") != std::string::npos; }))
      << client.getResult()->message;
  broadcaster.sendTransform(isocentreAt(1e-3 * (truth * scene.centreCt()).z() + 0.08));
  EXPECT_TRUE(waitFor([&] {
    ask();
    return client.getResult()->success;
  })) << client.getResult()->message;
  const PoseError error = scene.error(fromPose(client.getResult()->pose.pose), truth);
  EXPECT_LT(error.inplane_mm, kInplaneTolerance);
  EXPECT_LT(error.mtre_mm, kMtreTolerance);
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "localize_rostest");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  const int result = RUN_ALL_TESTS();
  spinner.stop();
  return result;
}
