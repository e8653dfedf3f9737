// Two views, their relative pose from tf, and a camera that moves in a fixed frame.
#include <gtest/gtest.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "node_probe.h"

namespace xray_registration {
namespace {

geometry_msgs::TransformStamped stamped(const std::string& parent, const std::string& child, const ros::Time& stamp,
                                        const RigidTransform& T_parent_child) {
  geometry_msgs::TransformStamped message;
  message.header.frame_id = parent;
  message.header.stamp = stamp;
  message.child_frame_id = child;
  message.transform = toTransform(T_parent_child);
  return message;
}

TEST(TwoViews, RegisterTogether) {
  Scene scene("two_views");
  NodeProbe probe("registration", {"ap", "lateral"});
  // The second camera stands a quarter turn around the head.
  const Eigen::Vector3d centre_camera = scene.pose(0) * scene.centreCt();
  RigidTransform T_lateral_ap = RigidTransform::Identity();
  T_lateral_ap.linear() = rotationFromVector(Eigen::Vector3d(0.0, M_PI / 2.0, 0.0));
  T_lateral_ap.translation() = centre_camera - T_lateral_ap.linear() * centre_camera;
  RigidTransform T_room_ap = RigidTransform::Identity();
  T_room_ap.linear() = rotationFromVector(Eigen::Vector3d(0.5, 0.1, 0.2));
  T_room_ap.translation() = Eigen::Vector3d(300.0, -200.0, 1500.0);

  ASSERT_TRUE(probe.connected());
  ASSERT_TRUE(probe.loadCt(scene.ctPath()).success);
  tf2_ros::TransformBroadcaster moving;
  tf2_ros::StaticTransformBroadcaster fixed;
  double seconds = 2000.0;
  const auto publish = [&](bool with_lateral) {
    seconds += 0.2;
    const ros::Time stamp(seconds);
    const ros::Time later(seconds + 0.005);  // Within the tolerance.
    // Both are rendered before one is sent: a slow machine needs longer for it than the node waits for the other view.
    const sensor_msgs::Image ap = scene.image(scene.pose(0), stamp, "ap_optical");
    const sensor_msgs::Image lateral = scene.image(T_lateral_ap * scene.pose(0), later, "lateral_optical");
    moving.sendTransform(stamped("room", "ap_optical", stamp, T_room_ap));
    probe.publish(ap, scene.info(ap.header), 0);
    if (with_lateral) probe.publish(lateral, scene.info(lateral.header), 1);
    return probe.answer(stamp);
  };
  ASSERT_TRUE(probe.setPose(scene.disturbed(scene.pose(0)), "ap_optical").success);

  // Without tf between the views there is no pose, and no identity in its place.
  RegistrationStatus status = publish(true);
  EXPECT_FALSE(status.accepted);
  EXPECT_NE(status.reason.find("transform"), std::string::npos) << status.reason;

  fixed.sendTransform(stamped("ap_optical", "lateral_optical", ros::Time(1.0), T_lateral_ap.inverse()));
  ASSERT_TRUE(waitFor([&] {
    status = publish(true);
    return status.reason.find("transform") == std::string::npos;
  }));
  ASSERT_TRUE(status.accepted) << status.reason;
  EXPECT_EQ(status.views_used.size(), 2U);
  // Two views see the depth: the project's measure of success for them is 1 mm.
  EXPECT_LT(scene.error(fromPose(status.pose), scene.pose(0)).mtre_mm, 1.0);

  // tf goes from the fixed frame.
  ASSERT_TRUE(waitFor([&] { return !probe.transforms(status.header.stamp).empty(); }));
  const geometry_msgs::TransformStamped transform = probe.transforms(status.header.stamp)[0];
  EXPECT_EQ(transform.header.frame_id, "room");
  EXPECT_LT(scene.error(T_room_ap.inverse() * fromTransform(transform.transform), scene.pose(0)).mtre_mm, 1.0);

  status = publish(false);
  EXPECT_FALSE(status.accepted);
  EXPECT_EQ(status.views_missing, std::vector<std::string>{"lateral"});
  EXPECT_NE(status.reason.find("lateral"), std::string::npos) << status.reason;

  status = publish(true);
  EXPECT_TRUE(status.accepted) << status.reason;

  // Each view's pictures say when and where that view was taken.
  ros::NodeHandle node;
  std::mutex mutex;
  std::map<std::string, std_msgs::Header> headers;
  std::vector<ros::Subscriber> pictures;
  for (const std::string topic : {"ap/drr", "ap/overlay", "lateral/drr", "lateral/overlay"}) {
    pictures.push_back(
        node.subscribe<sensor_msgs::Image>("registration/" + topic, 1, [&, topic](const sensor_msgs::ImageConstPtr& m) {
          const std::lock_guard<std::mutex> lock(mutex);
          headers[topic] = m->header;
        }));
  }
  const auto allOf = [&](double first_s) {  // All four of the frame at this time.
    const std::lock_guard<std::mutex> lock(mutex);
    return headers.size() == 4 && std::all_of(headers.begin(), headers.end(), [&](const auto& entry) {
             return std::abs(entry.second.stamp.toSec() - first_s) < 0.1;
           });
  };
  ASSERT_TRUE(waitFor([&] {
    status = publish(true);
    return waitFor([&] { return allOf(seconds); }, 1.0);
  }));
  const std::lock_guard<std::mutex> lock(mutex);
  for (const char* picture : {"drr", "overlay"}) {
    const std_msgs::Header ap = headers[std::string("ap/") + picture];
    const std_msgs::Header lateral = headers[std::string("lateral/") + picture];
    EXPECT_EQ(ap.frame_id, "ap_optical");
    EXPECT_EQ(ap.stamp, ros::Time(seconds));
    EXPECT_EQ(lateral.frame_id, "lateral_optical");
    EXPECT_EQ(lateral.stamp, ros::Time(seconds + 0.005));
  }
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "two_views_rostest");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
