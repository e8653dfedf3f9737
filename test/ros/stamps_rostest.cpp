// The table of docs/stamps_and_clocks.md in the wall's time. Each case runs by itself, in any order.
#include <gtest/gtest.h>

#include <memory>

#include "node_probe.h"

namespace xray_registration {
namespace {

const char* const kFrame = "xray_optical";

class Stamps : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = std::make_unique<Scene>("stamps");
    probe_ = std::make_unique<NodeProbe>("registration", std::vector<std::string>{""});
    ASSERT_TRUE(probe_->connected());
    ASSERT_TRUE(probe_->loadCt(scene_->ctPath()).success);
  }
  static void TearDownTestSuite() {
    probe_.reset();
    scene_.reset();
  }
  void SetUp() override { ASSERT_TRUE(probe_->trigger("reset")); }

  static sensor_msgs::Image image(const ros::Time& stamp, const std::string& frame = kFrame) {
    return scene_->image(scene_->pose(0), stamp, frame);
  }
  static RegistrationStatus answerTo(const sensor_msgs::Image& image) {
    const std::size_t before = probe_->statuses(image.header.stamp).size();
    probe_->publish(image, scene_->info(image.header));
    return probe_->answer(image.header.stamp, before + 1);
  }
  static RegistrationStatus answerTo(const ros::Time& stamp) { return answerTo(image(stamp)); }
  /// As a camera takes it whose clock is `ahead_s` ahead.
  static RegistrationStatus live(double ahead_s = 0.0) {
    return answerTo(ros::Time(ros::WallTime::now().toSec() + ahead_s));
  }
  static void start() { ASSERT_TRUE(probe_->setPose(scene_->disturbed(scene_->pose(0)), kFrame).success); }
  static void trackLive(double ahead_s = 0.0) {
    ASSERT_NO_FATAL_FAILURE(start());
    const RegistrationStatus status = live(ahead_s);
    ASSERT_TRUE(status.accepted) << status.reason;
  }
  /// Refused for `word`, nothing of it is published, and the pose is still known.
  static void expectRefused(const RegistrationStatus& status, const std::string& word) {
    EXPECT_FALSE(status.accepted);
    EXPECT_NE(status.reason.find(word), std::string::npos) << status.reason;
    EXPECT_EQ(status.state, RegistrationStatus::TRACKING);
  }
  static void expectTracked(const RegistrationStatus& status) {
    EXPECT_TRUE(status.accepted) << status.reason;
    EXPECT_EQ(status.state, RegistrationStatus::TRACKING);
    EXPECT_TRUE(waitFor([&] { return !probe_->transforms(status.header.stamp).empty(); }, 5.0)) << "no tf";
    EXPECT_LT(status.latency, 60.0);
    EXPECT_GT(status.latency, -0.6);
  }

  static std::unique_ptr<Scene> scene_;
  static std::unique_ptr<NodeProbe> probe_;
};

std::unique_ptr<Scene> Stamps::scene_;
std::unique_ptr<NodeProbe> Stamps::probe_;

TEST_F(Stamps, OneFarOffChangesNothing) {
  ASSERT_NO_FATAL_FAILURE(trackLive());
  for (const double off_s : {3600.0, -5.0, 2.0, -3600.0}) {
    const RegistrationStatus status = live(off_s);
    SCOPED_TRACE(std::to_string(off_s) + " s off");
    expectRefused(status, off_s > 0.0 ? "ahead of this node's clock" : "older than the last one");
    expectTracked(live());
    EXPECT_TRUE(probe_->transforms(status.header.stamp).empty());
    EXPECT_TRUE(probe_->poses(status.header.stamp).empty());
  }
}

TEST_F(Stamps, AheadOfNowIsNeverPublished) {
  ASSERT_NO_FATAL_FAILURE(trackLive());
  for (int i = 0; i < 5; ++i) expectRefused(live(3600.0), "ahead of this node's clock");
  expectTracked(live());
  expectTracked(live(0.3));  // Within stamps/max_ahead.
}

TEST_F(Stamps, RepeatedLateAndMissingOnesChangeNothing) {
  ASSERT_NO_FATAL_FAILURE(trackLive());
  const ros::Time early = ros::Time::now();
  const sensor_msgs::Image newest = image(early + ros::Duration(0.02));
  expectTracked(answerTo(newest));
  expectRefused(answerTo(newest), "stamp was already handled");
  expectRefused(answerTo(early), "older than the last one");
  expectRefused(answerTo(ros::Time()), "no stamp");
  expectTracked(live());
}

TEST_F(Stamps, OfTwoPublishersTheOneInFrontIsFollowed) {
  ASSERT_NO_FATAL_FAILURE(trackLive());
  for (int i = 0; i < 5; ++i) {
    expectRefused(live(-5.0), "older than the last one");
    expectTracked(live());
  }
}

TEST_F(Stamps, CameraThatRestartsItsClockIsFollowed) {
  ASSERT_NO_FATAL_FAILURE(trackLive());
  const double boot_s = ros::WallTime::now().toSec() - 0.1;
  expectRefused(live(-boot_s), "older than the last one");
  expectRefused(live(-boot_s), "older than the last one");
  for (int i = 0; i < 3; ++i) expectTracked(live(-boot_s));
}

TEST_F(Stamps, StepsOfTheCamerasClockAreFollowed) {
  ASSERT_NO_FATAL_FAILURE(trackLive(0.2));
  live(0.17);  // By milliseconds: taken, or late for once.
  expectTracked(live(0.2));
  expectRefused(live(-3.0), "older than the last one");
  expectRefused(live(-3.0), "older than the last one");
  for (int i = 0; i < 3; ++i) expectTracked(live(-3.0));
  expectRefused(live(0.0), "after the last one's");
  expectRefused(live(0.0), "after the last one's");
  for (int i = 0; i < 3; ++i) expectTracked(live(0.0));
}

// Shorter than a second; each time two frames are refused before the third is believed.
TEST_F(Stamps, LoopWithoutAClockGoesOn) {
  ASSERT_NO_FATAL_FAILURE(start());
  for (int loop = 0; loop < 3; ++loop) {
    for (int i = 0; i < 8; ++i) {
      const RegistrationStatus status = answerTo(ros::Time(20.0 + 0.1 * i));
      SCOPED_TRACE(std::to_string(loop) + " " + std::to_string(i));
      if (loop > 0 && i < 2) {
        expectRefused(status, "older than the last one");
      } else {
        EXPECT_TRUE(status.accepted) << status.reason;
        EXPECT_LT(status.latency, 60.0);
      }
    }
  }
}

TEST_F(Stamps, HeldImageIsNothingNew) {
  ASSERT_NO_FATAL_FAILURE(trackLive());
  sensor_msgs::Image shown = image(ros::Time::now());
  expectTracked(answerTo(shown));
  const auto again = [&] {
    shown.header.stamp = ros::Time::now();
    return answerTo(shown);
  };
  RegistrationStatus status = again();
  expectRefused(status, "held");
  EXPECT_TRUE(probe_->poses(status.header.stamp).empty());
  std::this_thread::sleep_for(std::chrono::milliseconds(350));  // health/hold_timeout is 0.3 s.
  status = again();
  EXPECT_NE(status.reason.find("held"), std::string::npos) << status.reason;
  EXPECT_EQ(status.state, RegistrationStatus::LOST);
  expectTracked(live());
}

TEST_F(Stamps, OtherFrameIsRefusedUntilReset) {
  ASSERT_NO_FATAL_FAILURE(trackLive());
  const auto other = [] { return image(ros::Time::now(), "other_optical"); };
  const RegistrationStatus status = answerTo(other());
  expectRefused(status, "two parents");
  EXPECT_TRUE(probe_->transforms(status.header.stamp).empty());
  expectTracked(live());
  ASSERT_TRUE(probe_->trigger("reset"));
  EXPECT_EQ(answerTo(other()).reason, "no initial pose is known yet");
  ASSERT_TRUE(probe_->setPose(scene_->disturbed(scene_->pose(0)), "other_optical").success);
  expectTracked(answerTo(other()));
}

TEST_F(Stamps, LeadingSlashIsNoOtherFrame) {
  ASSERT_TRUE(probe_->setPose(scene_->disturbed(scene_->pose(0)), "/xray_optical").success);
  for (const char* frame : {"/xray_optical", "xray_optical", "/xray_optical"}) {
    const RegistrationStatus status = answerTo(image(ros::Time::now(), frame));
    expectTracked(status);
    EXPECT_EQ(status.header.frame_id, kFrame);
    for (const auto& transform : probe_->transforms(status.header.stamp)) EXPECT_EQ(transform.header.frame_id, kFrame);
  }
}

TEST_F(Stamps, StartInTheCtsOwnFrameIsRefusedAtOnce) {
  for (const char* frame : {"ct", "/ct"}) {
    const SetInitialPose::Response answer = probe_->setPose(scene_->pose(0), frame);
    EXPECT_FALSE(answer.success);
    EXPECT_NE(answer.message.find("frames/ct"), std::string::npos) << answer.message;
  }
}

}  // namespace
}  // namespace xray_registration

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "stamps_rostest");
  ros::AsyncSpinner spinner(2);
  spinner.start();
  return RUN_ALL_TESTS();
}
