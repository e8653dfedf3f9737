// Simulated time: a clock that jumps back and a clock that stands.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <rosgraph_msgs/Clock.h>

#include <atomic>

#include "node_probe.h"

namespace xray_registration {
namespace {

const char* const kFrame = "xray_optical";

TEST(SimulatedTime, JumpForgetsThePoseAndKeepsTheCt) {
  ros::NodeHandle node;
  ros::Publisher clock = node.advertise<rosgraph_msgs::Clock>("/clock", 10, true);
  const auto setClock = [&](double seconds) {
    rosgraph_msgs::Clock message;
    message.clock = ros::Time(seconds);
    clock.publish(message);
  };
  Scene scene("sim_time");
  NodeProbe probe("registration", {""});
  const auto publish = [&](double seconds) {
    const sensor_msgs::Image image = scene.image(scene.pose(0), ros::Time(seconds), kFrame);
    probe.publish(image, scene.info(image.header));
    return probe.answer(image.header.stamp);
  };

  // Simulated time is set, and nobody publishes it.
  ASSERT_TRUE(probe.connected());
  RegistrationStatus status;
  ASSERT_TRUE(waitFor([&] {
    status = publish(99.0);
    return status.reason.find("/clock") != std::string::npos;
  })) << status.reason;
  setClock(100.0);
  ASSERT_TRUE(probe.loadCt(scene.ctPath()).success);
  ASSERT_TRUE(probe.setPose(scene.disturbed(scene.pose(0)), kFrame).success);
  ASSERT_TRUE(waitFor([&] { return ros::Time::now() == ros::Time(100.0); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // The node has its own connection to the clock.
  status = publish(100.0);
  ASSERT_TRUE(status.accepted) << status.reason;
  EXPECT_EQ(status.state, RegistrationStatus::TRACKING);
  setClock(100.5);
  ASSERT_TRUE(waitFor([&] { return ros::Time::now() == ros::Time(100.5); }));
  status = publish(100.5);
  ASSERT_TRUE(status.accepted) << status.reason;

  // A clock that only wavers changes nothing.
  setClock(100.45);
  ASSERT_TRUE(waitFor([&] { return ros::Time::now() == ros::Time(100.45); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // The node looks at the clock every 100 ms.
  status = publish(100.6);
  ASSERT_TRUE(status.accepted) << status.reason;

  // One that is far off changes nothing.
  for (const double seconds : {95.0, 3700.0}) {
    status = publish(seconds);
    EXPECT_FALSE(status.accepted);
    EXPECT_EQ(status.state, RegistrationStatus::TRACKING) << status.reason;
    EXPECT_TRUE(probe.poses(ros::Time(seconds)).empty());
  }
  status = publish(100.7);
  ASSERT_TRUE(status.accepted) << status.reason;

  // A run of them, in order, is another recording, also when the clock stands.
  for (const double seconds : {50.0, 50.1}) {
    status = publish(seconds);
    EXPECT_EQ(status.state, RegistrationStatus::TRACKING) << status.reason;
  }
  status = publish(50.2);
  EXPECT_EQ(status.state, RegistrationStatus::WAITING_FOR_POSE) << status.reason;
  ASSERT_TRUE(probe.setPose(scene.disturbed(scene.pose(0)), kFrame).success);
  status = publish(50.3);
  ASSERT_TRUE(status.accepted) << status.reason;

  // The recording starts again. Frames may be lost while the subscriptions are made anew.
  setClock(10.0);
  double seconds = 10.0;
  ASSERT_TRUE(waitFor([&] {
    seconds += 0.1;
    setClock(seconds);
    const sensor_msgs::Image image = scene.image(scene.pose(0), ros::Time(seconds), kFrame);
    probe.publish(image, scene.info(image.header));
    waitFor([&] { return !probe.statuses(image.header.stamp).empty(); }, 0.5);
    const std::vector<RegistrationStatus> answers = probe.statuses(image.header.stamp);
    return !answers.empty() && answers[0].state == RegistrationStatus::WAITING_FOR_POSE;
  }));
  EXPECT_NE(probe.answer(ros::Time(seconds)).ct, "");

  ASSERT_TRUE(probe.setPose(scene.disturbed(scene.pose(0)), kFrame).success);
  // A frame may overtake its clock message, which looks like another jump: then the pose is given again.
  ASSERT_TRUE(waitFor([&] {
    seconds += 0.1;
    setClock(seconds);
    if (!waitFor([&] { return ros::Time::now() == ros::Time(seconds); }, 1.0)) return false;
    const sensor_msgs::Image image = scene.image(scene.pose(0), ros::Time(seconds), kFrame);
    probe.publish(image, scene.info(image.header));
    waitFor([&] { return !probe.statuses(image.header.stamp).empty(); }, 1.0);
    const std::vector<RegistrationStatus> answers = probe.statuses(image.header.stamp);
    if (answers.empty()) return false;
    status = answers[0];
    if (status.state == RegistrationStatus::WAITING_FOR_POSE) probe.setPose(scene.disturbed(scene.pose(0)), kFrame);
    return status.accepted != 0;
  })) << status.reason;
  EXPECT_TRUE(waitFor([&] { return probe.transforms(status.header.stamp).size() == 1U; }));

  // A loop that is shorter than a second is a recording that starts again, too.
  const double end = seconds;
  setClock(end - 0.5);
  ASSERT_TRUE(waitFor([&] {
    probe.setPose(scene.disturbed(scene.pose(0)), kFrame);
    seconds = end - 0.45 + 0.001 * static_cast<double>(probe.statusCount() % 100);
    const sensor_msgs::Image image = scene.image(scene.pose(0), ros::Time(seconds), kFrame);
    probe.publish(image, scene.info(image.header));
    waitFor([&] { return !probe.statuses(image.header.stamp).empty(); }, 1.0);
    const std::vector<RegistrationStatus> answers = probe.statuses(image.header.stamp);
    return !answers.empty() && answers.back().accepted;
  }));

  // The clock stands still now; the node must go on telling how it is.
  std::atomic<int> diagnostics{0};
  const ros::Subscriber subscriber = node.subscribe<diagnostic_msgs::DiagnosticArray>(
      "/diagnostics", 10, [&](const diagnostic_msgs::DiagnosticArrayConstPtr&) { ++diagnostics; });
  EXPECT_TRUE(waitFor([&] { return diagnostics >= 2; }));
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "sim_time_rostest");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
