// ~register_landmarks of a running node, with one view and with two. Each case runs by itself.
#include <gtest/gtest.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <xray_registration/RegisterLandmarks.h>

#include <limits>
#include <memory>

#include "node_probe.h"

namespace xray_registration {
namespace {

/// Places in the head, mm from its middle: on no line, in no plane, and not like their mirror image.
std::vector<Eigen::Vector3d> places() {
  return {{0, -70, 10}, {-45, -50, 25}, {48, -42, 22}, {-60, 5, -10}, {62, 8, -14}, {3, 65, 30}, {5, -10, 75}};
}

geometry_msgs::Point pointMessage(const Eigen::Vector3d& point) {
  geometry_msgs::Point message;
  message.x = point.x();
  message.y = point.y();
  message.z = point.z();
  return message;
}

/// Where a picture shows a point, in the middle of a pixel, as somebody clicks it.
geometry_msgs::Point clicked(const Scene& scene, const RigidTransform& T_view_ct, const Eigen::Vector3d& point_ct) {
  const sensor_msgs::CameraInfo info = scene.info({});
  const Eigen::Vector3d p = T_view_ct * point_ct;
  return pointMessage(
      {std::round(info.K[0] * p.x() / p.z() + info.K[2]), std::round(info.K[4] * p.y() / p.z() + info.K[5]), 0.0});
}

RegisterLandmarks::Request landmarks(const Scene& scene, const RigidTransform& T_camera_ct, std::size_t count = 7) {
  RegisterLandmarks::Request request;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d point = scene.centreCt() + places()[i];
    request.points_ct.push_back(pointMessage(point * 1e-3));
    request.pixels.push_back(clicked(scene, T_camera_ct, point));
  }
  return request;
}

RegisterLandmarks::Response call(const std::string& name_space, const RegisterLandmarks::Request& request) {
  RegisterLandmarks service;
  service.request = request;
  const std::string name = name_space + "/registration/register_landmarks";
  if (!ros::service::waitForService(name, 30000) || !ros::service::call(name, service)) {
    service.response.message = "the call failed";
  }
  return service.response;
}

class Landmarks : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<Scene>("landmarks_" + std::to_string(ros::WallTime::now().toNSec()));
    one_ = std::make_unique<NodeProbe>("one/registration", std::vector<std::string>{"one"});
    two_ = std::make_unique<NodeProbe>("two/registration", std::vector<std::string>{"two/ap", "two/side"});
    ASSERT_TRUE(one_->connected());
    ASSERT_TRUE(two_->connected());
    // Nothing is known yet: neither a CT nor a camera.
    without_ct_ = call("one", landmarks(*scene_, scene_->pose(0)));
    ASSERT_TRUE(one_->loadCt(scene_->ctPath()).success);
    ASSERT_TRUE(two_->loadCt(scene_->ctPath()).success);
    without_camera_ = call("one", landmarks(*scene_, scene_->pose(0)));
  }
  static void TearDownTestSuite() {
    two_.reset();
    one_.reset();
    scene_.reset();
  }
  void SetUp() override {
    ASSERT_TRUE(one_->trigger("reset"));
    ASSERT_TRUE(two_->trigger("reset"));
  }

  static ros::Time nextStamp() {
    static ros::Time stamp(1000.0);
    stamp += ros::Duration(0.1);
    return stamp;
  }
  static RegistrationStatus publishOne(const RigidTransform& pose) {
    const sensor_msgs::Image image = scene_->image(pose, nextStamp(), "one_optical");
    one_->publish(image, scene_->info(image.header));
    return one_->answer(image.header.stamp);
  }
  static RigidTransform sideFromAp() {
    const Eigen::Vector3d centre = scene_->pose(0) * scene_->centreCt();
    RigidTransform T = RigidTransform::Identity();
    T.linear() = rotationFromVector(Eigen::Vector3d(0.0, 1.2, 0.0));
    T.translation() = centre - T.linear() * centre;
    return T;
  }
  static RegistrationStatus publishTwo(const RigidTransform& T_ap_ct) {
    const ros::Time stamp = nextStamp();
    const sensor_msgs::Image ap = scene_->image(T_ap_ct, stamp, "ap_optical");
    const sensor_msgs::Image side = scene_->image(sideFromAp() * T_ap_ct, stamp, "side_optical");
    two_->publish(ap, scene_->info(ap.header), 0);
    two_->publish(side, scene_->info(side.header), 1);
    return two_->answer(stamp);
  }

  static std::unique_ptr<Scene> scene_;
  static std::unique_ptr<NodeProbe> one_;
  static std::unique_ptr<NodeProbe> two_;
  static RegisterLandmarks::Response without_ct_;
  static RegisterLandmarks::Response without_camera_;
};

std::unique_ptr<Scene> Landmarks::scene_;
std::unique_ptr<NodeProbe> Landmarks::one_;
std::unique_ptr<NodeProbe> Landmarks::two_;
RegisterLandmarks::Response Landmarks::without_ct_;
RegisterLandmarks::Response Landmarks::without_camera_;

void expectRefused(const RegisterLandmarks::Response& response, const std::string& word) {
  EXPECT_FALSE(response.success);
  EXPECT_NE(response.message.find(word), std::string::npos) << "'" << word << "' is not in: " << response.message;
  EXPECT_TRUE(response.inliers.empty());
}

TEST_F(Landmarks, NeedACtAndACamera) {
  expectRefused(without_ct_, "no CT is loaded");
  expectRefused(without_camera_, "camera_info");
}

// Pixels are whole ones, so up to half a pixel off: 0.4 px rms, and 2.5 mm at the head's rim for one of 1.9 mm.
TEST_F(Landmarks, BecomeTheStart) {
  const RigidTransform truth = scene_->pose(4);
  EXPECT_NE(publishOne(truth).reason.find("pose"), std::string::npos);
  const RegisterLandmarks::Response response = call("one", landmarks(*scene_, truth));
  ASSERT_TRUE(response.success) << response.message;
  EXPECT_EQ(response.pose.header.frame_id, "one_optical");
  EXPECT_EQ(response.inliers.size(), 7U);
  EXPECT_EQ(response.residuals.size(), 7U);
  EXPECT_GT(response.reprojection_error, 0.0);
  EXPECT_LT(response.reprojection_error, 0.5);
  EXPECT_LT(scene_->error(fromPose(response.pose.pose), truth).inplane_mm, 3.0);
  const RegistrationStatus status = publishOne(truth);
  ASSERT_TRUE(status.accepted) << status.reason;
  EXPECT_LT(scene_->error(fromPose(status.pose), truth).inplane_mm, kInplaneTolerance);
}

TEST_F(Landmarks, LeaveOutAWrongPair) {
  publishOne(scene_->pose(0));
  RegisterLandmarks::Request request = landmarks(*scene_, scene_->pose(0));
  request.pixels[2].x += 15.0;
  const RegisterLandmarks::Response response = call("one", request);
  ASSERT_TRUE(response.success) << response.message;
  EXPECT_EQ(response.inliers, (std::vector<std::uint32_t>{0, 1, 3, 4, 5, 6}));
  EXPECT_GT(response.residuals.at(2), 10.0);
  EXPECT_LT(response.reprojection_error, 0.5);
}

TEST_F(Landmarks, AreRefusedWithTheReason) {
  publishOne(scene_->pose(0));
  const RegisterLandmarks::Request good = landmarks(*scene_, scene_->pose(0));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double centre_x = scene_->centreCt().x() * 1e-3;
  using Request = RegisterLandmarks::Request;
  const auto on_a_line = [&](Request* request) {
    for (std::size_t i = 0; i < 7; ++i) {
      const Eigen::Vector3d point = scene_->centreCt() + (static_cast<double>(i) - 3.0) * Eigen::Vector3d(15, 8, 12);
      request->points_ct[i] = pointMessage(point * 1e-3);
      request->pixels[i] = clicked(*scene_, scene_->pose(0), point);
    }
  };
  const auto mirrored = [&](Request* request) {
    for (geometry_msgs::Point& point : request->points_ct) point.x = 2.0 * centre_x - point.x;
  };
  const auto behind = [&](Request* request) {  // As a camera would see them behind itself.
    for (geometry_msgs::Point& pixel : request->pixels) {
      pixel.x = 127.0 - pixel.x;
      pixel.y = 127.0 - pixel.y;
    }
    for (geometry_msgs::Point& point : request->points_ct) point.x = 2.0 * centre_x - point.x;
  };
  const std::vector<std::pair<std::string, std::function<void(Request*)>>> cases = {
      {"too few", [](Request* r) { *r = Request(); }},
      {"too few",
       [](Request* r) {
         r->points_ct.resize(3);
         r->pixels.resize(3);
       }},
      {"7 points_ct and 6 pixels", [](Request* r) { r->pixels.pop_back(); }},
      {"7 points and 1 views", [](Request* r) { r->views = {""}; }},
      {"no view 'oblique'", [](Request* r) { r->views.assign(7, "oblique"); }},
      {"same point", [](Request* r) { r->points_ct[3] = r->points_ct[1]; }},
      {"same pixel", [](Request* r) { r->pixels[3] = r->pixels[1]; }},
      {"line", on_a_line},
      {"mirror", mirrored},
      {"mirror", behind},  // What lies behind looks like its mirror image in front.
      {"not finite", [&](Request* r) { r->points_ct[2].y = nan; }},
      {"not finite", [&](Request* r) { r->pixels[2].y = nan; }},
      {"outside of the image", [](Request* r) { r->pixels[2].y = 128.0; }},
      {"outside of the image", [](Request* r) { r->pixels[2].x = -3.0; }},
      {"outside of the CT", [](Request* r) { r->points_ct[2].z += 1.0; }},
      {"mm for metres", [](Request* r) {
         for (geometry_msgs::Point& point : r->points_ct) {
           point.x *= 1e3;
           point.y *= 1e3;
           point.z *= 1e3;
         }
       }}};
  for (const auto& [word, spoil] : cases) {
    Request request = good;
    spoil(&request);
    expectRefused(call("one", request), word);
  }
  // Nothing was set.
  EXPECT_NE(publishOne(scene_->pose(0)).reason.find("no initial pose"), std::string::npos);
}

// Three points that two views show; the second's place comes from tf.
TEST_F(Landmarks, OfTwoViewsAddUp) {
  const RigidTransform truth = scene_->pose(2);
  publishTwo(truth);
  RegisterLandmarks::Request request = landmarks(*scene_, truth, 3);
  const RegisterLandmarks::Request beside = landmarks(*scene_, sideFromAp() * truth, 3);
  request.points_ct.insert(request.points_ct.end(), beside.points_ct.begin(), beside.points_ct.end());
  request.pixels.insert(request.pixels.end(), beside.pixels.begin(), beside.pixels.end());
  request.views = {"ap", "ap", "", "side", "side", "side"};
  tf2_ros::StaticTransformBroadcaster broadcaster;
  geometry_msgs::TransformStamped side;
  side.header.frame_id = "ap_optical";
  side.header.stamp = ros::Time(1.0);
  side.child_frame_id = "side_optical";
  side.transform = toTransform(sideFromAp().inverse());
  broadcaster.sendTransform(side);
  RegisterLandmarks::Response response;
  ASSERT_TRUE(waitFor([&] {
    response = call("two", request);
    return response.success || response.message.find("transform") == std::string::npos;
  }));
  ASSERT_TRUE(response.success) << response.message;
  EXPECT_EQ(response.inliers.size(), 6U);
  EXPECT_EQ(response.pose.header.frame_id, "ap_optical");
  // Two views see the depth as well.
  EXPECT_LT(scene_->error(fromPose(response.pose.pose), truth).mtre_mm, 3.0);
  const RegistrationStatus status = publishTwo(truth);
  EXPECT_TRUE(status.accepted) << status.reason;
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "landmarks_rostest");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
