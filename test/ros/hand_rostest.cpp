// The hand on the CT, as rviz's messages bring it: ~ct_marker is dragged, previews follow, letting go sets the pose;
// and landmarks that are clicked. Each case runs by itself.
#include <actionlib/server/simple_action_server.h>
#include <geometry_msgs/PointStamped.h>
#include <gtest/gtest.h>
#include <visualization_msgs/InteractiveMarkerFeedback.h>
#include <visualization_msgs/InteractiveMarkerInit.h>
#include <visualization_msgs/InteractiveMarkerUpdate.h>
#include <visualization_msgs/Marker.h>
#include <visualization_msgs/MarkerArray.h>
#include <xray_registration/LocalizeAction.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "node_probe.h"
#include "ros/localize_client.h"

namespace xray_registration {
namespace {

using visualization_msgs::InteractiveMarker;
using visualization_msgs::InteractiveMarkerFeedback;

const char* const kFrame = "xray_optical";
const char* const kMarker = "registration/ct_marker";
constexpr Rgb kPreviewColour = {255, 140, 0};

/// Where the pixels of the preview's lines are, on average, and how many there are.
struct Lines {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  long count = 0;
};

Lines linesOf(const sensor_msgs::Image& image) {
  Lines lines;
  for (std::size_t i = 0; i + 2 < image.data.size(); i += 3) {
    if (image.data[i] != kPreviewColour[0] || image.data[i + 1] != kPreviewColour[1] || image.data[i + 2] != 0)
      continue;
    const std::size_t pixel = i / 3;
    lines.middle += Eigen::Vector2d(static_cast<double>(pixel % image.width), static_cast<double>(pixel / image.width));
    ++lines.count;
  }
  if (lines.count > 0) lines.middle /= static_cast<double>(lines.count);
  return lines;
}

class Hand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<Scene>("hand_" + std::to_string(ros::WallTime::now().toNSec()));
    probe_ = std::make_unique<NodeProbe>("registration", std::vector<std::string>{""});
    ASSERT_TRUE(probe_->connected());
    ASSERT_TRUE(probe_->loadCt(scene_->ctPath()).success);
  }
  static void TearDownTestSuite() {
    probe_.reset();
    scene_.reset();
  }

  /// From whatever start the node has by now.
  static void expectRegistered(const RigidTransform& truth) {
    RegistrationStatus status;
    ASSERT_TRUE(waitFor([&] {
      status = publish(truth);
      return status.registered;
    })) << status.reason;
    ASSERT_TRUE(status.accepted) << status.reason;
    EXPECT_LT(scene_->error(fromPose(status.pose), truth).inplane_mm, kInplaneTolerance);
  }

  void SetUp() override {
    ASSERT_TRUE(waitFor([&] {
      return init_.connected() && update_.connected() && previews_.connected() && feedback_.getNumSubscribers() > 0 &&
             points_.getNumSubscribers() > 0 && pixels_.getNumSubscribers() > 0;
    }));
    ASSERT_TRUE(probe_->trigger("reset"));
    ASSERT_TRUE(probe_->trigger("clear_landmarks"));
    publish(scene_->pose(0));  // From here on the node knows the camera.
    ASSERT_TRUE(waitFor([&] { return marker().has_value(); }));
  }

  /// The newest description of the marker.
  const std::optional<InteractiveMarker>& marker() {
    for (const visualization_msgs::InteractiveMarkerInit& init : init_.take()) {
      marker_.reset();
      for (const InteractiveMarker& marker : init.markers) {
        if (marker.name == "ct") marker_ = marker;
      }
    }
    return marker_;
  }

  static RegistrationStatus publish(const RigidTransform& pose) {
    static ros::Time stamp(1000.0);
    stamp += ros::Duration(0.1);
    const sensor_msgs::Image image = scene_->image(pose, stamp, kFrame);
    probe_->publish(image, scene_->info(image.header));
    return probe_->answer(stamp);
  }

  /// The marker's own place for a pose of the CT: the CT's middle.
  geometry_msgs::Pose markerPose(const RigidTransform& T_camera_ct) const {
    RigidTransform T = T_camera_ct;
    T.translation() = T_camera_ct * scene_->centreCt();
    return toPose(T);
  }
  RigidTransform ctPose(const geometry_msgs::Pose& marker) const {
    RigidTransform T = fromPose(marker);
    T.translation() -= T.linear() * scene_->centreCt();
    return T;
  }

  void send(std::uint8_t event, const RigidTransform& T_camera_ct, const std::string& control = "move_x") {
    InteractiveMarkerFeedback message;
    message.header.frame_id = kFrame;
    message.client_id = "somebody";
    message.marker_name = "ct";
    message.control_name = control;
    message.event_type = event;
    message.pose = markerPose(T_camera_ct);
    feedback_.publish(message);
  }
  void drag(const RigidTransform& from, const RigidTransform& to) {
    send(InteractiveMarkerFeedback::MOUSE_DOWN, from);
    send(InteractiveMarkerFeedback::POSE_UPDATE, to);
  }
  void letGo(const RigidTransform& at) { send(InteractiveMarkerFeedback::MOUSE_UP, at); }

  /// Chooses an entry of the menu by its title and that of the entry above it.
  bool choose(const std::string& parent, const std::string& title) {
    const auto& entries = marker().value().menu_entries;
    for (const auto& entry : entries) {
      // A check box stands before the title.
      const bool titled = entry.title.size() >= title.size() &&
                          entry.title.compare(entry.title.size() - title.size(), title.size(), title) == 0;
      const bool below = std::any_of(entries.begin(), entries.end(), [&](const auto& above) {
        return above.id == entry.parent_id && above.title == parent;
      });
      if (!titled || (parent.empty() ? entry.parent_id != 0 : !below)) continue;
      InteractiveMarkerFeedback message;
      message.header.frame_id = kFrame;
      message.client_id = "somebody";
      message.marker_name = "ct";
      message.event_type = InteractiveMarkerFeedback::MENU_SELECT;
      message.menu_entry_id = entry.id;
      message.pose = marker().value().pose;
      feedback_.publish(message);
      return true;
    }
    return false;
  }

  /// Waits for a preview with lines whose middle is near a place.
  testing::AssertionResult previewNear(const Eigen::Vector2d& pixel) {
    constexpr double kTolerance_px = 10.0;  // Lines are not spread evenly about the middle; what is tried is 16 px off.
    Lines last;
    const bool came = waitFor([&] {
      for (const sensor_msgs::Image& image : previews_.take()) {
        last = linesOf(image);
        if (last.count > 100 && (last.middle - pixel).norm() < kTolerance_px) return true;
      }
      return false;
    });
    if (came) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "the last preview has " << last.count << " pixels of lines about "
                                       << last.middle.transpose();
  }
  Eigen::Vector2d pixelOf(const RigidTransform& T_camera_ct, const Eigen::Vector3d& point_ct) const {
    const sensor_msgs::CameraInfo info = scene_->info({});
    const Eigen::Vector3d p = T_camera_ct * point_ct;
    return {info.K[0] * p.x() / p.z() + info.K[2], info.K[4] * p.y() / p.z() + info.K[5]};
  }
  static RigidTransform shifted(RigidTransform T, const Eigen::Vector3d& by) {
    T.translation() += by;
    return T;
  }

  std::vector<Eigen::Vector3d> places() const {
    std::vector<Eigen::Vector3d> points = {{0, -70, 10}, {-45, -50, 25}, {48, -42, 22}, {-60, 5, -10},
                                           {62, 8, -14}, {3, 65, 30},    {5, -10, 75}};
    for (Eigen::Vector3d& point : points) point += scene_->centreCt();
    return points;
  }
  void clickPoint(const Eigen::Vector3d& point_mm, const std::string& frame) {
    geometry_msgs::PointStamped message;
    message.header.frame_id = frame;
    message.point.x = point_mm.x() * 1e-3;
    message.point.y = point_mm.y() * 1e-3;
    message.point.z = point_mm.z() * 1e-3;
    points_.publish(message);
  }
  void clickPixel(const Eigen::Vector2d& pixel) {
    geometry_msgs::Point message;
    message.x = std::round(pixel.x());
    message.y = std::round(pixel.y());
    pixels_.publish(message);
  }
  /// Balls of a colour; of the newest message.
  long balls(float red, float green, float blue) {
    for (const visualization_msgs::MarkerArray& message : landmarks_.take()) shown_ = message;
    return std::count_if(shown_.markers.begin(), shown_.markers.end(), [&](const visualization_msgs::Marker& marker) {
      return marker.type == visualization_msgs::Marker::SPHERE && marker.action == visualization_msgs::Marker::ADD &&
             (marker.color.r > 0.5F) == (red > 0.5F) && (marker.color.g > 0.5F) == (green > 0.5F) &&
             (marker.color.b > 0.5F) == (blue > 0.5F);
    });
  }
  /// One after the other, each when the one before has come: they are different topics.
  void clickPair(std::size_t number, const RigidTransform& T_camera_ct, double off_px = 0.0) {
    clickPoint(places()[number], "ct");
    ASSERT_TRUE(waitFor([&] { return balls(1, 1, 0) == 1; }));  // It waits for its pixel.
    clickPixel(pixelOf(T_camera_ct, places()[number]) + Eigen::Vector2d(off_px, 0.0));
    ASSERT_TRUE(waitFor([&] { return balls(1, 1, 0) == 0; }));
  }

  static std::unique_ptr<Scene> scene_;
  static std::unique_ptr<NodeProbe> probe_;
  ros::NodeHandle node_;
  Messages<visualization_msgs::InteractiveMarkerInit> init_{std::string(kMarker) + "/update_full"};
  Messages<visualization_msgs::InteractiveMarkerUpdate> update_{std::string(kMarker) + "/update"};
  Messages<sensor_msgs::Image> previews_{"registration/preview"};
  Messages<visualization_msgs::MarkerArray> landmarks_{"registration/landmarks"};
  Messages<visualization_msgs::Marker> surface_{"registration/ct_surface"};
  ros::Publisher feedback_ = node_.advertise<InteractiveMarkerFeedback>(std::string(kMarker) + "/feedback", 100);
  ros::Publisher points_ = node_.advertise<geometry_msgs::PointStamped>("clicked_point", 100);
  ros::Publisher pixels_ = node_.advertise<geometry_msgs::Point>("image_raw_mouse_left", 100);
  std::optional<InteractiveMarker> marker_;
  visualization_msgs::MarkerArray shown_;
};

std::unique_ptr<Scene> Hand::scene_;
std::unique_ptr<NodeProbe> Hand::probe_;

TEST_F(Hand, HasTheCtInTheBeamBeforeAnyPose) {
  ASSERT_TRUE(waitFor([&] {  // Where it was before is forgotten by ~reset.
    const geometry_msgs::Point at = marker().value().pose.position;
    return std::abs(at.x) < 0.001 && std::abs(at.y) < 0.001;
  }));
  const InteractiveMarker found = marker().value();
  EXPECT_EQ(found.header.frame_id, kFrame);
  EXPECT_TRUE(found.header.stamp.isZero());  // rviz keeps it in that frame.
  EXPECT_GT(found.pose.position.z, 0.3);
  std::size_t triangles = 0, moves = 0, turns = 0;
  for (const auto& control : found.controls) {
    for (const auto& part : control.markers) triangles += part.points.size() / 3;
    moves += control.interaction_mode == visualization_msgs::InteractiveMarkerControl::MOVE_AXIS ? 1 : 0;
    turns += control.interaction_mode == visualization_msgs::InteractiveMarkerControl::ROTATE_AXIS ? 1 : 0;
  }
  EXPECT_GT(triangles, 1000U);
  EXPECT_EQ(moves, 3U);
  EXPECT_EQ(turns, 3U);
}

// The lines' middle follows the CT's, whose outline is symmetric within a few pixels.
TEST_F(Hand, ShowsWhereTheCtIsDraggedAndSetsItWhereItIsLetGo) {
  const RigidTransform truth = scene_->pose(3);
  const RigidTransform away = shifted(truth, {-40, 25, 0});
  const Eigen::Vector3d& centre = scene_->centreCt();
  drag(scene_->pose(0), away);
  ASSERT_TRUE(previewNear(pixelOf(away, centre)));
  const RigidTransform near = scene_->disturbed(truth);
  send(InteractiveMarkerFeedback::POSE_UPDATE, near);
  ASSERT_TRUE(previewNear(pixelOf(near, centre)));
  // Meanwhile nothing is searched for, and nothing is set.
  const RegistrationStatus during = publish(truth);
  EXPECT_FALSE(during.accepted);
  EXPECT_NE(during.reason.find("by hand"), std::string::npos) << during.reason;
  letGo(near);
  ASSERT_NO_FATAL_FAILURE(expectRegistered(truth));
}

TEST_F(Hand, FollowsWhatIsRegistered) {
  const RigidTransform truth = scene_->pose(2);
  ASSERT_TRUE(probe_->setPose(scene_->disturbed(truth), kFrame).success);
  ASSERT_TRUE(publish(truth).accepted);
  update_.take();
  ASSERT_TRUE(waitFor([&] {
    publish(truth);
    for (const visualization_msgs::InteractiveMarkerUpdate& update : update_.take()) {
      for (const auto& pose : update.poses) {
        if (pose.name == "ct" && scene_->error(ctPose(pose.pose), truth).inplane_mm < kInplaneTolerance) return true;
      }
    }
    return false;
  }));
}

// A CT that is tracked stays tracked while somebody plays with the marker, until it is let go.
TEST_F(Hand, LeavesTrackingAlone) {
  const RigidTransform truth = scene_->pose(0);
  ASSERT_TRUE(probe_->setPose(scene_->disturbed(truth), kFrame).success);
  ASSERT_TRUE(publish(truth).accepted);
  const RigidTransform away = shifted(truth, {30, 0, 0});
  drag(truth, away);
  ASSERT_TRUE(previewNear(pixelOf(away, scene_->centreCt())));
  for (int i = 0; i < 3; ++i) {
    const RegistrationStatus status = publish(scene_->pose(i));
    EXPECT_TRUE(status.accepted) << status.reason;
    EXPECT_LT(scene_->error(fromPose(status.pose), scene_->pose(i)).inplane_mm, kInplaneTolerance);
  }
  // The preview goes on over the newest X-ray, where the marker is.
  EXPECT_TRUE(previewNear(pixelOf(away, scene_->centreCt())));
  letGo(truth);
}

TEST_F(Hand, IsTakenOffWhenNobodyLetsGo) {
  const RigidTransform truth = scene_->pose(0);
  drag(truth, shifted(truth, {30, 0, 0}));
  ASSERT_TRUE(waitFor([&] { return publish(truth).reason.find("by hand") != std::string::npos; }));
  RegistrationStatus status;
  EXPECT_TRUE(waitFor([&] {
    status = publish(truth);
    return status.reason.find("by hand") == std::string::npos;
  }));
  EXPECT_NE(status.reason.find("no initial pose"), std::string::npos) << status.reason;
}

TEST_F(Hand, IgnoresPosesThatAreNone) {
  InteractiveMarkerFeedback message;
  message.header.frame_id = kFrame;
  message.client_id = "somebody";
  message.marker_name = "ct";
  message.event_type = InteractiveMarkerFeedback::POSE_UPDATE;  // The quaternion of a default message is 0.
  feedback_.publish(message);
  message.header.frame_id = "no_such_frame";
  message.pose.orientation.w = 1.0;
  feedback_.publish(message);
  letGo(scene_->pose(0));
  RegistrationStatus status;
  ASSERT_TRUE(waitFor([&] {
    status = publish(scene_->pose(0));
    return status.reason.find("by hand") == std::string::npos;
  }));
  EXPECT_NE(status.reason.find("no initial pose"), std::string::npos) << status.reason;
}

TEST_F(Hand, ResetsByMenu) {
  const RigidTransform truth = scene_->pose(0);
  ASSERT_TRUE(probe_->setPose(scene_->disturbed(truth), kFrame).success);
  ASSERT_TRUE(publish(truth).accepted);
  ASSERT_TRUE(choose("", "Reset"));
  EXPECT_TRUE(waitFor([&] { return publish(truth).reason.find("no initial pose") != std::string::npos; }));
}

TEST_F(Hand, HidesAndShowsTheBonesByMenu) {
  const auto last_action = [&](int* action) {
    for (const visualization_msgs::Marker& surface : surface_.take()) *action = surface.action;
    return *action;
  };
  int action = -1;
  ASSERT_TRUE(waitFor([&] { return last_action(&action) == visualization_msgs::Marker::ADD; }));
  ASSERT_TRUE(choose("Show", "CT"));
  EXPECT_TRUE(waitFor([&] { return last_action(&action) == visualization_msgs::Marker::DELETE; }));
  ASSERT_TRUE(choose("Show", "CT"));
  EXPECT_TRUE(waitFor([&] { return last_action(&action) == visualization_msgs::Marker::ADD; }));
}

TEST_F(Hand, TakesClickedLandmarks) {
  const RigidTransform truth = scene_->pose(5);
  for (std::size_t i = 0; i < 7; ++i) ASSERT_NO_FATAL_FAILURE(clickPair(i, truth, i == 2 ? 14.0 : 0.0));
  // Six agree, one is left out.
  ASSERT_TRUE(waitFor([&] { return balls(0, 1, 0) == 6; }));
  EXPECT_EQ(balls(1, 0, 0), 1);
  // It is proposed, and nothing more.
  EXPECT_TRUE(previewNear(pixelOf(truth, scene_->centreCt())));
  EXPECT_NE(publish(truth).reason.find("no initial pose"), std::string::npos);
  ASSERT_TRUE(choose("Landmarks", "Use their pose"));
  ASSERT_NO_FATAL_FAILURE(expectRegistered(truth));

  ASSERT_TRUE(choose("Landmarks", "Take back the last click"));
  ASSERT_TRUE(waitFor([&] { return balls(0, 1, 0) == 5; }));
  ASSERT_TRUE(choose("Landmarks", "Clear"));
  ASSERT_TRUE(waitFor([&] { return balls(0, 1, 0) == 0 && balls(1, 0, 0) == 0; }));
  EXPECT_FALSE(probe_->trigger("use_landmarks"));
}

// rviz gives points in its fixed frame, and the CT may not be in tf yet: what was clicked is the marker then.
TEST_F(Hand, TakesPointsOnTheMarker) {
  const RigidTransform pose = shifted(scene_->pose(0), {35, -20, 60});
  drag(scene_->pose(0), pose);
  ASSERT_TRUE(previewNear(pixelOf(pose, scene_->centreCt())));
  letGo(pose);
  clickPoint(pose * places()[1], kFrame);
  ASSERT_TRUE(waitFor([&] { return balls(1, 1, 0) == 1; }));
  for (const visualization_msgs::Marker& ball : shown_.markers) {
    if (ball.type != visualization_msgs::Marker::SPHERE || ball.action != visualization_msgs::Marker::ADD) continue;
    EXPECT_EQ(ball.header.frame_id, "ct");
    const Eigen::Vector3d at = 1e3 * Eigen::Vector3d(ball.pose.position.x, ball.pose.position.y, ball.pose.position.z);
    EXPECT_LT((at - places()[1]).norm(), 0.1);
  }
  clickPoint(places()[1], "no_such_frame");
  clickPixel({64, 64});
  EXPECT_TRUE(waitFor([&] { return balls(1, 1, 1) == 1; }));
}

TEST(LocalizeClientTest, SaysWhenNobodyServes) {
  LocalizeClient client(ros::NodeHandle("nobody"));
  EXPECT_FALSE(client.start(std::nullopt, ""));
}

TEST(LocalizeClientTest, SendsWhereTheMarkerIs) {
  ros::NodeHandle node("somebody");
  std::mutex mutex;
  std::vector<LocalizeGoal> goals;
  actionlib::SimpleActionServer<LocalizeAction> server(node, "localize", false);
  server.registerGoalCallback([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    goals.push_back(*server.acceptNewGoal());
    server.setSucceeded();
  });
  server.start();
  LocalizeClient client(node);
  RigidTransform pose = RigidTransform::Identity();
  pose.translation() << 10, 20, 700;
  ASSERT_TRUE(waitFor([&] { return client.start(pose, "camera"); }));
  const auto count = [&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return goals.size();
  };
  ASSERT_TRUE(waitFor([&] { return count() == 1; }));
  ASSERT_TRUE(client.start(std::nullopt, ""));
  ASSERT_TRUE(waitFor([&] { return count() == 2; }));
  const std::lock_guard<std::mutex> lock(mutex);
  EXPECT_EQ(goals[0].centre.header.frame_id, "camera");
  EXPECT_NEAR(goals[0].centre.pose.position.z, 0.7, 1e-9);
  EXPECT_GT(goals[0].rotation, 0.5);
  EXPECT_GT(goals[0].translation, 0.05);
  EXPECT_TRUE(goals[1].centre.header.frame_id.empty());
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "hand_rostest");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
