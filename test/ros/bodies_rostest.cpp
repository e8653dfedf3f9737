// Bodies that move on their own: two bones in a CT, and an implant without one. Each case runs by itself, in any order.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <visualization_msgs/InteractiveMarkerFeedback.h>
#include <visualization_msgs/InteractiveMarkerInit.h>

#include <algorithm>
#include <memory>

#include "body_probe.h"
#include "xray_registration/pipeline/overlay.h"
#include "xray_registration/volume/surface_mesh.h"

namespace xray_registration {
namespace {

// Of a body's centre; bones of 2.5 mm voxels, in two views. What is not found is off by more than ten times as much.
constexpr double kBodyToleranceMm = 1.5;
constexpr double kAwayMm = -40.0;

class Bones : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<BodyScene>();
    bones_ = std::make_unique<BodyProbe>("bones", std::vector<std::string>{"upper", "lower"});
    ASSERT_TRUE(bones_->connected());
    const LoadCt::Response loaded = bones_->probe.loadCt(BodyScene::ctPath());
    ASSERT_TRUE(loaded.success) << loaded.message;
  }
  static void TearDownTestSuite() {
    bones_.reset();
    scene_.reset();
  }
  void SetUp() override {
    ASSERT_TRUE(bones_->probe.trigger("reset"));
    ASSERT_TRUE(bones_->probe.setPose(scene_->disturbed(scene_->pose(0)), "bones_front").success);
  }

  /// `upper_mm`: how far the upper bone is from where it is looked for.
  static RegistrationStatus publish(int number, double upper_mm = 0.0) {
    T_camera_ct_ = scene_->pose(number);
    const std::array<RigidTransform, 2> moved = {scene_->moved(0, upper_mm), scene_->moved(1, 0.0)};
    for (std::size_t i = 0; i < 2; ++i) T_camera_bodies_[i] = T_camera_ct_ * moved[i];
    return bones_->publish(scene_->parts(T_camera_ct_, moved));
  }

  static void expectAccepted(const RegistrationStatus& status, std::size_t body, const std::string& name,
                             const std::string& frame) {
    ASSERT_EQ(status.bodies.size(), 2U) << status.reason;
    const BodyStatus& told = status.bodies[body];
    EXPECT_EQ(told.name, name);
    EXPECT_EQ(told.frame, frame);
    EXPECT_TRUE(told.accepted) << told.reason;
    EXPECT_EQ(told.reason, "");
    EXPECT_TRUE(told.solved);
    EXPECT_LT(scene_->error(body, fromPose(told.pose), T_camera_bodies_[body]), kBodyToleranceMm);

    ASSERT_TRUE(bones_->hasTransform(frame));
    const auto transforms = bones_->transforms(frame);
    EXPECT_EQ(transforms.size(), 1U);
    EXPECT_EQ(transforms[0].header.frame_id, "bones_front");
    EXPECT_LT(scene_->error(body, fromTransform(transforms[0].transform), T_camera_bodies_[body]), kBodyToleranceMm);

    ASSERT_TRUE(bones_->hasPose(name));
    const auto pose = bones_->pose(name);
    EXPECT_EQ(pose->header.frame_id, "bones_front");
    EXPECT_LT(scene_->error(body, fromPose(pose->pose.pose), T_camera_bodies_[body]), kBodyToleranceMm);
    EXPECT_GT(pose->pose.covariance[0], 0.0);
  }

  static std::unique_ptr<BodyScene> scene_;
  static std::unique_ptr<BodyProbe> bones_;
  static RigidTransform T_camera_ct_;
  static std::array<RigidTransform, 2> T_camera_bodies_;
};

std::unique_ptr<BodyScene> Bones::scene_;
std::unique_ptr<BodyProbe> Bones::bones_;
RigidTransform Bones::T_camera_ct_;
std::array<RigidTransform, 2> Bones::T_camera_bodies_;

TEST_F(Bones, EachHasItsTransformPoseAndVerdict) {
  for (int number = 0; number < 3; ++number) {
    SCOPED_TRACE(number);
    const RegistrationStatus status = publish(number);
    ASSERT_TRUE(status.accepted) << status.reason;
    expectAccepted(status, 0, "upper", "upper_bone");
    expectAccepted(status, 1, "lower", "lower");
    EXPECT_TRUE(bones_->hasTransform("ct"));
  }
}

TEST_F(Bones, OneThatIsNotWhereItMayBeIsRefusedWhileTheOthersStandAndComesBack) {
  ASSERT_TRUE(publish(0).accepted);
  const RegistrationStatus status = publish(1, kAwayMm);
  ASSERT_TRUE(status.accepted) << status.reason;
  ASSERT_EQ(status.bodies.size(), 2U);
  EXPECT_FALSE(status.bodies[0].accepted);
  EXPECT_NE(status.bodies[0].reason, "");
  expectAccepted(status, 1, "lower", "lower");
  // Sent with the other one's, which has come.
  EXPECT_TRUE(bones_->transforms("upper_bone").empty());
  const auto last = bones_->pose("upper");
  EXPECT_TRUE(!last || last->header.stamp != bones_->stamp());

  expectAccepted(publish(2), 0, "upper", "upper_bone");
}

TEST_F(Bones, DiagnosticsNameWhatIsRefused) {
  const Newest<diagnostic_msgs::DiagnosticArray> diagnostics("/diagnostics");
  ASSERT_TRUE(publish(0).accepted);
  publish(1, kAwayMm);
  // Both nodes tell theirs on this topic.
  EXPECT_TRUE(waitFor([&] {
    const auto told = diagnostics.get();
    return told && std::any_of(told->status.begin(), told->status.end(), [](const auto& status) {
             return status.message.find("refused bodies: upper") != std::string::npos;
           });
  }));
}

TEST_F(Bones, ASurfaceOfEachIsInItsFrame) {
  const Newest<visualization_msgs::Marker> rest("bones/registration/ct_surface");
  const Newest<visualization_msgs::Marker> upper("bones/registration/bodies/upper/surface");
  const Newest<visualization_msgs::Marker> lower("bones/registration/bodies/lower/surface");
  ASSERT_TRUE(waitFor([&] { return rest.get() && upper.get() && lower.get(); }));
  EXPECT_EQ(rest.get()->header.frame_id, "ct");
  EXPECT_EQ(upper.get()->header.frame_id, "upper_bone");
  EXPECT_EQ(lower.get()->header.frame_id, "lower");
  EXPECT_NE(upper.get()->ns, lower.get()->ns);
  EXPECT_NE(upper.get()->color, lower.get()->color);
  // In the CT's coordinates: around the bone's centre.
  ASSERT_GT(upper.get()->points.size(), 300U);
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero();
  for (const auto& point : upper.get()->points) mean_mm += Eigen::Vector3d(point.x, point.y, point.z) * 1e3;
  mean_mm /= static_cast<double>(upper.get()->points.size());
  EXPECT_LT((mean_mm - scene_->centreOf(0)).norm(), 15.0);
  // The rest's has a hole there.
  const auto inside_upper = [&](const geometry_msgs::Point& point) {
    return (Eigen::Vector3d(point.x, point.y, point.z) * 1e3 - scene_->centreOf(0)).norm() < 12.0;
  };
  EXPECT_TRUE(std::none_of(rest.get()->points.begin(), rest.get()->points.end(), inside_upper));
}

TEST_F(Bones, PicturesShowEachInItsColourAndARefusedOneInRed) {
  const Newest<sensor_msgs::Image> overlay("bones/registration/front/overlay");
  const Newest<sensor_msgs::Image> drr("bones/registration/front/drr");
  ASSERT_TRUE(waitFor([&] { return overlay.connected() && drr.connected(); }));
  ASSERT_TRUE(publish(0).accepted);
  ASSERT_TRUE(waitFor([&] { return overlay.hasStamp(bones_->stamp()) && drr.hasStamp(bones_->stamp()); }));
  EXPECT_GT(countColour(*overlay.get(), kAcceptedColour), 50);
  EXPECT_GT(countColour(*overlay.get(), bodyColour(0)), 50);
  EXPECT_GT(countColour(*overlay.get(), bodyColour(1)), 50);
  EXPECT_EQ(countColour(*overlay.get(), kRefusedColour), 0);

  publish(1, kAwayMm);
  ASSERT_TRUE(waitFor([&] { return overlay.hasStamp(bones_->stamp()); }));
  EXPECT_GT(countColour(*overlay.get(), kRefusedColour), 10);
  EXPECT_EQ(countColour(*overlay.get(), bodyColour(0)), 0);
  EXPECT_GT(countColour(*overlay.get(), bodyColour(1)), 50);
}

TEST_F(Bones, AStartOfOneIsTakenWithItsName) {
  ASSERT_TRUE(publish(0).accepted);
  SetInitialPose call;
  call.request.pose.header.frame_id = "bones_front";
  call.request.pose.pose = toPose(T_camera_bodies_[0]);
  call.request.body = "middle";
  ASSERT_TRUE(ros::service::call("bones/registration/set_initial_pose", call));
  EXPECT_FALSE(call.response.success);
  EXPECT_NE(call.response.message.find("upper, lower"), std::string::npos) << call.response.message;
  call.request.body = "upper";
  ASSERT_TRUE(ros::service::call("bones/registration/set_initial_pose", call));
  EXPECT_TRUE(call.response.success) << call.response.message;
  const RegistrationStatus status = publish(1);
  ASSERT_TRUE(status.accepted) << status.reason;
  expectAccepted(status, 0, "upper", "upper_bone");
  // A cold start, which looks around; the other one was followed.
  EXPECT_GT(status.bodies[0].iterations, status.bodies[1].iterations);
}

TEST_F(Bones, AStartOfOneIsTakenFromItsTopic) {
  ros::NodeHandle node;
  ros::Publisher publisher =
      node.advertise<geometry_msgs::PoseWithCovarianceStamped>("bones/registration/bodies/lower/initialpose", 1);
  ASSERT_TRUE(waitFor([&] { return publisher.getNumSubscribers() > 0; }));
  ASSERT_TRUE(publish(0).accepted);
  geometry_msgs::PoseWithCovarianceStamped start;
  start.header.frame_id = "bones_front";
  start.pose.pose = toPose(T_camera_bodies_[1]);
  publisher.publish(start);
  // Nothing answers a topic: one of the next frames is a cold start of that body.
  int number = 0;
  EXPECT_TRUE(waitFor([&] {
    const RegistrationStatus status = publish(++number % 4);
    return status.bodies.size() == 2 && status.bodies[1].iterations > status.bodies[0].iterations + 10;
  }));
}

TEST_F(Bones, AStartOfOneWaitsForThatOfTheCt) {
  ASSERT_TRUE(bones_->probe.trigger("reset"));
  publish(0);
  SetInitialPose call;
  call.request.pose.header.frame_id = "bones_front";
  call.request.pose.pose = toPose(T_camera_bodies_[0]);
  call.request.body = "upper";
  ASSERT_TRUE(ros::service::call("bones/registration/set_initial_pose", call));
  RegistrationStatus status = publish(0);
  EXPECT_FALSE(status.accepted);
  ASSERT_EQ(status.bodies.size(), 2U);
  EXPECT_EQ(status.bodies[0].reason, status.reason);
  ASSERT_TRUE(bones_->probe.setPose(scene_->disturbed(scene_->pose(0)), "bones_front").success);
  expectAccepted(publish(0), 0, "upper", "upper_bone");
}

// By the messages of rviz: the menu of ~ct_marker selects the bone, and letting go of it is its start.
TEST_F(Bones, OneIsMovedByHand) {
  using visualization_msgs::InteractiveMarkerFeedback;
  ros::NodeHandle node;
  const std::string topic = "bones/registration/ct_marker";
  const Newest<visualization_msgs::InteractiveMarkerInit> init(topic + "/update_full");
  const Newest<sensor_msgs::Image> preview("bones/registration/front/preview");
  const ros::Publisher publisher = node.advertise<InteractiveMarkerFeedback>(topic + "/feedback", 100);
  ASSERT_TRUE(publish(0).accepted);
  ASSERT_TRUE(waitFor([&] {
    return publisher.getNumSubscribers() > 0 && preview.connected() && init.get() && !init.get()->markers.empty();
  }));
  InteractiveMarkerFeedback feedback;
  feedback.header.frame_id = "bones_front";
  feedback.client_id = "somebody";
  feedback.marker_name = "ct";
  RigidTransform T_camera_marker = T_camera_bodies_[0];
  T_camera_marker.translation() = T_camera_bodies_[0] * scene_->centreOf(0);
  feedback.pose = toPose(T_camera_marker);
  const auto send = [&](std::uint8_t event) {
    feedback.event_type = event;
    publisher.publish(feedback);
  };
  const std::vector<visualization_msgs::MenuEntry> menu = init.get()->markers.front().menu_entries;
  for (const visualization_msgs::MenuEntry& entry : menu) {
    const bool below_move = std::any_of(menu.begin(), menu.end(), [&](const auto& above) {
      return above.id == entry.parent_id && above.title == "Move";
    });
    if (below_move && entry.title.find("upper") != std::string::npos) feedback.menu_entry_id = entry.id;
  }
  ASSERT_NE(feedback.menu_entry_id, 0U);
  send(InteractiveMarkerFeedback::MENU_SELECT);
  ASSERT_TRUE(waitFor([&] {
    const auto& markers = init.get()->markers;
    return std::any_of(markers.begin(), markers.end(),
                       [](const auto& marker) { return marker.description == "upper"; });
  }));
  feedback.menu_entry_id = 0;
  feedback.control_name = "move_x";
  send(InteractiveMarkerFeedback::MOUSE_DOWN);
  send(InteractiveMarkerFeedback::POSE_UPDATE);
  EXPECT_TRUE(waitFor([&] { return preview.get() && countColour(*preview.get(), bodyColour(0)) > 20; }));
  send(InteractiveMarkerFeedback::MOUSE_UP);
  int number = 0;
  EXPECT_TRUE(waitFor([&] {
    const RegistrationStatus status = publish(++number % 4);
    return status.bodies.size() == 2 && status.bodies[0].iterations > status.bodies[1].iterations + 10;
  }));
}

/// No CT at all: the first body stands for it.
class Implant : public testing::Test {
 protected:
  static std::string mesh() { return std::string(XRAY_REGISTRATION_SOURCE) + "/test/ros/data/implant.stl"; }
};

TEST_F(Implant, NeedsNoCt) {
  BodyProbe implant("implant", {"plate"});
  ASSERT_TRUE(implant.connected());
  const AttenuationVolume volume = voxelise(readMesh(mesh()), 0.02);
  const Eigen::Vector3d centre = anatomicalCentreCt(volume);
  const RigidTransform truth = TwoCameras::lookingAt(centre);
  Twist off;
  off << 1.5, -1.5, 0.5, 0.03, -0.02, 0.02;
  ASSERT_TRUE(ros::service::waitForService("implant/registration/set_initial_pose", 30000));
  ASSERT_TRUE(implant.probe.setPose(updatedPose(truth, off, truth * centre), "implant_front").success);
  RegistrationStatus status;
  waitFor([&] {  // Frames are refused until it is loaded.
    status = implant.publish({{&volume, truth}});
    return status.registered;
  });
  ASSERT_TRUE(status.accepted) << status.reason;
  ASSERT_EQ(status.bodies.size(), 1U);
  EXPECT_EQ(status.bodies[0].name, "plate");
  EXPECT_TRUE(status.bodies[0].accepted);
  const auto error = [&](const RigidTransform& found) { return (found * centre - truth * centre).norm(); };
  EXPECT_LT(error(fromPose(status.bodies[0].pose)), kBodyToleranceMm);
  for (const char* frame : {"plate", "implant_ct"}) {
    ASSERT_TRUE(implant.hasTransform(frame)) << frame;
    EXPECT_LT(error(fromTransform(implant.transforms(frame)[0].transform)), kBodyToleranceMm) << frame;
  }
  EXPECT_TRUE(implant.hasPose("plate"));
  const Newest<visualization_msgs::Marker> surface("implant/registration/bodies/plate/surface");
  EXPECT_TRUE(waitFor([&] { return surface.get() && surface.get()->points.size() > 300; }));
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "bodies_rostest");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
