#include "xray_registration/ros/bag_session.h"

#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/String.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdio>
#include <fstream>

#include "tools/common/bag_frames.h"
#include "tools/common/session_messages.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration {
namespace {

using tools::cameraInfoMessage;
using tools::imageMessage;

const XrayCamera kCamera{4, 3, 100.0, 100.0, 1.5, 1.0};

BagView view(const std::string& name) { return {name, name + "_xray_optical", RigidTransform::Identity()}; }

void writeFrame(BagSessionWriter* writer, const BagView& view, double stamp_s, std::uint16_t value) {
  const ros::Time stamp(stamp_s);
  writer->writeImage(view, imageMessage(Image<std::uint16_t>(4, 3, value), view.frame_id, stamp),
                     cameraInfoMessage(kCamera, view.frame_id, stamp));
}

RigidTransform somePose() {
  return updatedPose(RigidTransform::Identity(), (Twist() << 1.0, 2.0, 800.0, 0.1, 0.2, 0.3).finished(), {0, 0, 0});
}

class BagSessionTest : public testing::Test {
 protected:
  void TearDown() override { std::remove(path_.c_str()); }

  std::string refusal(const BagSessionOptions& options = {}) const {
    try {
      BagSession session(path_, options);
    } catch (const BagSessionError& error) {
      return error.what();
    }
    return "";
  }

  void writeTwoViews(bool with_tf) const {
    BagView second = view("oblique");
    second.T_view_first = somePose();
    BagSessionWriter writer(path_);
    if (with_tf) writer.writeViews({view("ap"), second}, ros::Time(10.0));
    writeFrame(&writer, view("ap"), 10.0, 1);
    writeFrame(&writer, second, 10.005, 2);  // A little later: the same frame.
    writeFrame(&writer, second, 11.0, 3);    // The first view is missing here.
    writeFrame(&writer, view("ap"), 12.0, 4);
    writeFrame(&writer, second, 12.0, 5);
    writer.writeGroundTruth(second, ros::Time(11.0), somePose());
    writer.close();
  }

  // One file per test: tests may run at the same time.
  std::string path_ =
      testing::TempDir() + "bag_session_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".bag";
};

TEST_F(BagSessionTest, ReadsWhatWasWritten) {
  BagSessionWriter writer(path_);
  writeFrame(&writer, view("ap"), 10.0, 17);
  writer.writeGroundTruth(view("ap"), ros::Time(10.0), somePose());
  writer.close();
  const BagSession session(path_);
  ASSERT_EQ(session.views().size(), 1U);
  EXPECT_EQ(session.views()[0].name, "ap");
  EXPECT_EQ(session.views()[0].frame_id, "ap_xray_optical");
  ASSERT_EQ(session.frameCount(), 1U);
  const BagFrame frame = session.frame(0);
  ASSERT_TRUE(frame.views[0].image);
  EXPECT_EQ(frame.views[0].image->data[0], 17);
  ASSERT_TRUE(frame.views[0].camera_info);
  EXPECT_DOUBLE_EQ(frame.views[0].camera_info->K[0], 100.0);
  ASSERT_TRUE(frame.T_first_ct_true);
  EXPECT_TRUE(frame.T_first_ct_true->isApprox(somePose(), 1e-9));  // Metres and back.
  EXPECT_THROW(session.frame(1), std::out_of_range);
}

TEST_F(BagSessionTest, BodiesHaveTheirTruthBelowTheCts) {
  BagSessionWriter writer(path_);
  writeFrame(&writer, view("ap"), 10.0, 17);
  writer.writeBodyGroundTruth(view("ap"), ros::Time(10.0), "T12", somePose());
  writer.close();
  rosbag::Bag bag(path_, rosbag::bagmode::Read);
  rosbag::View truth(bag, rosbag::TopicQuery("/ap/ground_truth/T12"));
  ASSERT_EQ(truth.size(), 1U);
  const auto message = truth.begin()->instantiate<geometry_msgs::PoseStamped>();
  ASSERT_TRUE(message);
  EXPECT_EQ(message->header.frame_id, "ap_xray_optical");
  EXPECT_EQ(message->header.stamp, ros::Time(10.0));
  EXPECT_NEAR(message->pose.position.z, 1e-3 * somePose().translation().z(), 1e-12);
}

TEST_F(BagSessionTest, GroupsViewsByStamp) {
  writeTwoViews(true);
  const BagSession session(path_);
  ASSERT_EQ(session.views().size(), 2U);
  EXPECT_TRUE(session.views()[1].T_view_first.isApprox(somePose(), 1e-9));
  ASSERT_EQ(session.frameCount(), 3U);
  const BagFrame first = session.frame(0);
  ASSERT_TRUE(first.views[0].image && first.views[1].image);
  EXPECT_EQ(first.stamp, ros::Time(10.0));
  EXPECT_EQ(first.views[1].image->data[0], 2);
  const BagFrame second = session.frame(1);
  EXPECT_FALSE(second.views[0].image);
  ASSERT_TRUE(second.views[1].image);
  EXPECT_EQ(second.stamp, ros::Time(11.0));
  // The truth of the second view, carried into the first: T_view_first⁻¹ · T_view_first is the identity.
  ASSERT_TRUE(second.T_first_ct_true);
  EXPECT_TRUE(second.T_first_ct_true->isApprox(RigidTransform::Identity(), 1e-9));
  EXPECT_EQ(session.frame(2).views[1].image->data[0], 5);
}

TEST_F(BagSessionTest, ToleranceDecidesWhatIsOneFrame) {
  writeTwoViews(true);
  BagSessionOptions options;
  options.tolerance_s = 0.001;
  EXPECT_EQ(BagSession(path_, options).frameCount(), 4U);
}

TEST_F(BagSessionTest, OrderOfTheNamedViewsCounts) {
  writeTwoViews(true);
  const BagSession session(path_, {{"oblique", "ap"}, 0.02});
  EXPECT_EQ(session.views()[0].name, "oblique");
  EXPECT_TRUE(session.views()[1].T_view_first.isApprox(somePose().inverse(), 1e-9));
}

TEST_F(BagSessionTest, ViewsWithoutTransformAreRefused) {
  writeTwoViews(false);
  EXPECT_NE(refusal().find("/tf_static does not connect 'ap_xray_optical' and 'oblique_xray_optical'"),
            std::string::npos);
  EXPECT_EQ(refusal({{"oblique"}, 0.02}), "");  // One view needs none.
}

TEST_F(BagSessionTest, UnknownViewListsTheOthers) {
  writeTwoViews(true);
  EXPECT_NE(refusal({{"lateral"}, 0.02}).find("has no images on /lateral/image_raw; views in it: ap, oblique"),
            std::string::npos);
}

TEST_F(BagSessionTest, MissingCameraInfo) {
  rosbag::Bag bag(path_, rosbag::bagmode::Write);
  bag.write("/ap/image_raw", ros::Time(1.0), imageMessage(Image<std::uint16_t>(4, 3), "ap", ros::Time(1.0)));
  bag.close();
  EXPECT_NE(refusal().find("/ap/camera_info"), std::string::npos);
}

TEST_F(BagSessionTest, NoImages) {
  rosbag::Bag bag(path_, rosbag::bagmode::Write);
  bag.write("/words", ros::Time(1.0), std_msgs::String());
  bag.close();
  EXPECT_NE(refusal().find("has no X-rays"), std::string::npos);
}

TEST_F(BagSessionTest, NotABag) {
  std::ofstream(path_) << "words";
  EXPECT_NE(refusal().find("cannot be read as a bag"), std::string::npos);
  EXPECT_NE(refusal().find(path_), std::string::npos);
}

TEST_F(BagSessionTest, BagThatWasNotClosed) {
  const std::string open = path_ + ".active";
  BagSessionWriter writer(open);
  for (int i = 1; i <= 3; ++i) writeFrame(&writer, view("ap"), i, 1);
  // What is on the disk before close() is what is there after a crash.
  std::ofstream(path_, std::ios::binary) << std::ifstream(open, std::ios::binary).rdbuf();
  writer.close();
  std::remove(open.c_str());
  EXPECT_NE(refusal().find("rosbag reindex " + path_), std::string::npos) << refusal();
  EXPECT_THROW(readPoses(path_, "/ap/ground_truth", "ct"), BagSessionError);
}

// Views' names become names of files, bodies' names keys of tables.
TEST_F(BagSessionTest, NamesThatAreNoRosNamesArePassedOver) {
  BagSessionWriter writer(path_);
  writeFrame(&writer, view("../../evil"), 10.0, 1);
  writeFrame(&writer, view("ap"), 10.0, 17);
  for (const char* body : {"T12", "../evil", "\x1b[2J"}) {
    writer.writeBodyGroundTruth(view("ap"), ros::Time(10.0), body, somePose());
  }
  writer.close();
  const BagSession session(path_);
  ASSERT_EQ(session.views().size(), 1U);
  EXPECT_EQ(session.views()[0].name, "ap");
  const auto& bodies = session.frame(0).T_first_bodies_true;
  ASSERT_EQ(bodies.size(), 1U);
  EXPECT_EQ(bodies.begin()->first, "T12");
  BagSessionOptions options;
  options.views = {"../../evil"};
  EXPECT_NE(refusal(options).find("has no images on"), std::string::npos);
}

TEST_F(BagSessionTest, OneImagePerStamp) {
  BagSessionWriter writer(path_);
  for (const std::uint16_t value : {1, 2}) {
    for (const double stamp_s : {10.0, 11.0}) writeFrame(&writer, view("ap"), stamp_s, value);
  }
  writer.close();
  std::string said;
  const BagSession session(path_, {}, [&said](LogLevel, const std::string& text) { said += text + '\n'; });
  ASSERT_EQ(session.frameCount(), 2U);
  EXPECT_EQ(session.frame(0).views[0].image->data[0], 1);
  EXPECT_EQ(session.frame(1).stamp, ros::Time(11.0));
  EXPECT_NE(said.find("2 images on /ap/image_raw have the stamp of an earlier one"), std::string::npos) << said;
}

TEST_F(BagSessionTest, ImagesWithoutAStampAreRefusedOneByOne) {
  rosbag::Bag bag(path_, rosbag::bagmode::Write);
  for (const double received_s : {5.0, 6.0}) {
    bag.write("/ap/image_raw", ros::Time(received_s), imageMessage(Image<std::uint16_t>(4, 3), "ap", ros::Time()));
    bag.write("/ap/camera_info", ros::Time(received_s), cameraInfoMessage(kCamera, "ap", ros::Time()));
  }
  bag.close();
  const BagSession session(path_);
  ASSERT_EQ(session.frameCount(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto views = tools::rawViews(session, session.frame(i));
    EXPECT_FALSE(views.at(0).image);
    EXPECT_EQ(views.at(0).problem, "the image has no stamp (it is zero)");
  }
}

TEST_F(BagSessionTest, FirstPose) {
  BagSessionWriter writer(path_);
  writer.writeGroundTruth(view("ap"), ros::Time(3.0), somePose());
  writer.close();
  const StampedPose pose = readPoses(path_, "/ap/ground_truth", "ct", 1).at(0);
  EXPECT_EQ(pose.frame_id, "ap_xray_optical");
  EXPECT_TRUE(pose.T_frame_ct.isApprox(somePose(), 1e-9));
  EXPECT_THROW(readPoses(path_, "/other", "ct"), BagSessionError);
}

TEST_F(BagSessionTest, FirstPoseMustBeRigid) {
  geometry_msgs::PoseStamped pose;
  pose.pose.orientation.w = 3.0;
  rosbag::Bag bag(path_, rosbag::bagmode::Write);
  bag.write("/pose", ros::Time(1.0), pose);
  bag.write("/words", ros::Time(1.0), std_msgs::String());
  bag.close();
  EXPECT_THROW(readPoses(path_, "/pose", "ct"), BagSessionError);
  EXPECT_THROW(readPoses(path_, "/words", "ct"), BagSessionError);
}

TEST_F(BagSessionTest, PosesFromTransforms) {
  tf2_msgs::TFMessage message;
  message.transforms.resize(2);
  for (auto& transform : message.transforms) {
    transform.header.frame_id = "ap";
    transform.child_frame_id = "other";
    transform.transform = toTransform(RigidTransform::Identity());
  }
  message.transforms[1].child_frame_id = "ct";
  message.transforms[1].transform = toTransform(somePose());
  rosbag::Bag bag(path_, rosbag::bagmode::Write);
  for (const double stamp_s : {1.0, 2.0}) {
    message.transforms[1].header.stamp = ros::Time(stamp_s);
    bag.write("/tf", ros::Time(stamp_s), message);
  }
  bag.close();
  const auto poses = readPoses(path_, "/tf", "ct");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[1].stamp, ros::Time(2.0));
  EXPECT_TRUE(poses[1].T_frame_ct.isApprox(somePose(), 1e-9));
  EXPECT_EQ(readPoses(path_, "/tf", "ct", 1).size(), 1U);
  EXPECT_THROW(readPoses(path_, "/tf", "patient"), BagSessionError);
}

TEST_F(BagSessionTest, UnwritableFile) {
  EXPECT_THROW(BagSessionWriter("/no/such/folder/session.bag"), BagSessionError);
}

}  // namespace
}  // namespace xray_registration
