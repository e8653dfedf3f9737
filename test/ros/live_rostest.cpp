// What is taken live only: mode on_demand with a start from the parameters, and a camera that moves in a fixed frame.
// Each case runs by itself, in any order.
#include <gtest/gtest.h>
#include <tf2_ros/transform_broadcaster.h>

#include <memory>

#include "node_probe.h"

namespace xray_registration {
namespace {

class OnDemand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<Scene>("on_demand");
    probe_ = std::make_unique<NodeProbe>("on_demand/registration", std::vector<std::string>{"on_demand"});
    ASSERT_TRUE(probe_->connected());
  }
  static void TearDownTestSuite() {
    probe_.reset();
    scene_.reset();
  }

  /// The first CT of all, from whichever case: the one that the initial pose is for.
  void SetUp() override {
    const LoadCt::Response loaded = probe_->loadCt(scene_->ctPath());
    ASSERT_TRUE(loaded.success) << loaded.message;
  }

  static RegistrationStatus answerTo(const RigidTransform& pose) {
    stamp_ += ros::Duration(0.1);
    const sensor_msgs::Image image = scene_->image(pose, stamp_, "on_demand_optical");
    probe_->publish(image, scene_->info(image.header));
    return probe_->answer(stamp_);
  }
  static void expectRegistered(const RigidTransform& pose) {
    const RegistrationStatus status = answerTo(pose);
    ASSERT_TRUE(status.accepted) << status.reason;
    EXPECT_LT(scene_->error(fromPose(status.pose), pose).inplane_mm, kInplaneTolerance);
    EXPECT_TRUE(waitFor([&] { return !probe_->poses(status.header.stamp).empty(); }));
    EXPECT_TRUE(probe_->transforms(status.header.stamp).empty());  // publish_tf: false
  }
  static void expectUnasked(const RigidTransform& pose) {
    const RegistrationStatus status = answerTo(pose);
    EXPECT_FALSE(status.accepted);
    EXPECT_FALSE(status.registered);
    EXPECT_NE(status.reason.find("on_demand"), std::string::npos) << status.reason;
  }

  static std::unique_ptr<Scene> scene_;
  static std::unique_ptr<NodeProbe> probe_;
  static ros::Time stamp_;
};

std::unique_ptr<Scene> OnDemand::scene_;
std::unique_ptr<NodeProbe> OnDemand::probe_;
ros::Time OnDemand::stamp_{1000.0};

TEST_F(OnDemand, RegistersOneFrameForTheInitialPoseAndForEachRequest) {
  expectRegistered(scene_->pose(0));
  expectUnasked(scene_->pose(0));
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(probe_->trigger("register_once"));
    expectRegistered(scene_->pose(1));
    expectUnasked(scene_->pose(1));
  }
}

TEST_F(OnDemand, RegistersOneFrameForAGivenPose) {
  expectRegistered(scene_->pose(0));
  ASSERT_TRUE(probe_->setPose(scene_->disturbed(scene_->pose(2)), "on_demand_optical").success);
  expectRegistered(scene_->pose(2));
  expectUnasked(scene_->pose(2));
}

TEST_F(OnDemand, AsksAgainUntilAFrameCanBeUsed) {
  stamp_ += ros::Duration(0.1);
  sensor_msgs::Image image = scene_->image(scene_->pose(0), stamp_, "on_demand_optical");
  image.encoding = "bgr8";
  probe_->publish(image, scene_->info(image.header));
  EXPECT_FALSE(probe_->answer(stamp_).registered);
  expectRegistered(scene_->pose(0));
  expectUnasked(scene_->pose(0));
}

TEST_F(OnDemand, ResetGoesBackToTheInitialPose) {
  expectRegistered(scene_->pose(0));
  ASSERT_TRUE(probe_->trigger("reset"));
  expectRegistered(scene_->pose(0));
  expectUnasked(scene_->pose(0));
}

TEST_F(OnDemand, InitialPoseIsForItsCtAlone) {
  const std::filesystem::path other = std::filesystem::path(scene_->ctPath()).parent_path() / "xray_other_ct.nii.gz";
  std::filesystem::copy_file(scene_->ctPath(), other, std::filesystem::copy_options::overwrite_existing);
  const LoadCt::Response loaded = probe_->loadCt(other.string());
  std::filesystem::remove(other);
  ASSERT_TRUE(loaded.success) << loaded.message;
  expectUnasked(scene_->pose(0));
  ASSERT_TRUE(probe_->trigger("register_once"));
  RegistrationStatus status = answerTo(scene_->pose(0));
  EXPECT_EQ(status.state, RegistrationStatus::WAITING_FOR_POSE);
  ASSERT_TRUE(probe_->trigger("reset"));
  ASSERT_TRUE(probe_->trigger("register_once"));
  status = answerTo(scene_->pose(0));
  EXPECT_EQ(status.state, RegistrationStatus::WAITING_FOR_POSE);

  ASSERT_TRUE(probe_->loadCt(scene_->ctPath()).success);
  expectRegistered(scene_->pose(0));
}

/// The CT rests in the room, the camera goes around it.
class MovingCamera : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<Scene>("moving");
    probe_ = std::make_unique<NodeProbe>("moving/registration", std::vector<std::string>{"moving"});
    broadcaster_ = std::make_unique<tf2_ros::TransformBroadcaster>();
    ASSERT_TRUE(probe_->connected());
    ASSERT_TRUE(probe_->loadCt(scene_->ctPath()).success);
    // Until the node listens to this process's tf, it finds nothing.
    ASSERT_TRUE(probe_->setPose(scene_->disturbed(scene_->pose(0)), kCamera).success);
    ASSERT_TRUE(waitFor([] { return answerAt(0).accepted != 0; }));
  }
  static void TearDownTestSuite() {
    broadcaster_.reset();
    probe_.reset();
    scene_.reset();
  }
  void SetUp() override {
    ASSERT_TRUE(probe_->trigger("reset"));
    ASSERT_TRUE(probe_->setPose(scene_->disturbed(scene_->pose(0)), kCamera).success);
  }

  /// T_room_camera: each step goes 25° around the head, more than a jump may be (accept/max_jump_rad).
  static RigidTransform cameraAt(int step) {
    const Eigen::Vector3d centre = scene_->pose(0) * scene_->centreCt();
    RigidTransform T_camera0_camera = RigidTransform::Identity();
    T_camera0_camera.linear() = rotationFromVector(Eigen::Vector3d(0.0, 0.44 * step, 0.0));
    T_camera0_camera.translation() = centre - T_camera0_camera.linear() * centre;
    RigidTransform T_room_camera0 = RigidTransform::Identity();
    T_room_camera0.linear() = rotationFromVector(Eigen::Vector3d(0.5, 0.1, 0.2));
    T_room_camera0.translation() = Eigen::Vector3d(300.0, -200.0, 1500.0);
    return T_room_camera0 * T_camera0_camera;
  }
  static RigidTransform truth(int step) { return cameraAt(step).inverse() * cameraAt(0) * scene_->pose(0); }
  static void sendImage(int step) {
    const sensor_msgs::Image image = scene_->image(truth(step), stamp_, kCamera);
    probe_->publish(image, scene_->info(image.header));
  }
  static void sendCamera(int step) {
    geometry_msgs::TransformStamped message;
    message.header.frame_id = "room";
    message.header.stamp = stamp_;
    message.child_frame_id = kCamera;
    message.transform = toTransform(cameraAt(step));
    broadcaster_->sendTransform(message);
  }
  static RegistrationStatus answerAt(int step) {
    stamp_ += ros::Duration(0.2);
    sendCamera(step);
    sendImage(step);
    return probe_->answer(stamp_);
  }

  static constexpr const char* kCamera = "moving_optical";
  static std::unique_ptr<Scene> scene_;
  static std::unique_ptr<NodeProbe> probe_;
  static std::unique_ptr<tf2_ros::TransformBroadcaster> broadcaster_;
  static ros::Time stamp_;
};

std::unique_ptr<Scene> MovingCamera::scene_;
std::unique_ptr<NodeProbe> MovingCamera::probe_;
std::unique_ptr<tf2_ros::TransformBroadcaster> MovingCamera::broadcaster_;
ros::Time MovingCamera::stamp_{3000.0};

TEST_F(MovingCamera, IsFollowedAndTheRoomStandsBelowTheCt) {
  for (int step = 0; step < 3; ++step) {
    const RegistrationStatus status = answerAt(step);
    ASSERT_TRUE(status.accepted) << "step " << step << ": " << status.reason;
    EXPECT_LT(scene_->error(fromPose(status.pose), truth(step)).inplane_mm, kInplaneTolerance);
    ASSERT_TRUE(waitFor([&] { return !probe_->transforms(stamp_).empty(); }));
    const geometry_msgs::TransformStamped transform = probe_->transforms(stamp_)[0];  // invert_tf
    EXPECT_EQ(transform.header.frame_id, "ct");
    EXPECT_EQ(transform.child_frame_id, "room");
    const RigidTransform T_camera_ct = cameraAt(step).inverse() * fromTransform(transform.transform).inverse();
    EXPECT_LT(scene_->error(T_camera_ct, truth(step)).mtre_mm, kMtreTolerance);
  }
}

TEST_F(MovingCamera, IsFollowedWhenItsTransformIsLate) {
  ASSERT_TRUE(answerAt(0).accepted);
  stamp_ += ros::Duration(0.2);
  sendImage(1);
  // Long enough for the image to be taken up first, on most machines; else the case is only easier.
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  sendCamera(1);
  const RegistrationStatus status = probe_->answer(stamp_);
  ASSERT_TRUE(status.accepted) << status.reason;
  EXPECT_LT(scene_->error(fromPose(status.pose), truth(1)).inplane_mm, kInplaneTolerance);
}

TEST_F(MovingCamera, IsNotGuessed) {
  ASSERT_TRUE(answerAt(0).accepted);
  stamp_ += ros::Duration(0.2);
  sendImage(0);
  const RegistrationStatus status = probe_->answer(stamp_);
  EXPECT_FALSE(status.accepted);
  EXPECT_FALSE(status.registered);
  EXPECT_NE(status.reason.find("transform"), std::string::npos) << status.reason;
  EXPECT_TRUE(probe_->poses(stamp_).empty());
  const RegistrationStatus next = answerAt(1);
  EXPECT_TRUE(next.accepted) << next.reason;
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "live_rostest");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
