#include "xray_registration/ros/view_synchroniser.h"

#include <gtest/gtest.h>

#include <boost/make_shared.hpp>

namespace xray_registration {
namespace {

using Clock = ViewSynchroniser::Clock;

class Scene {
 public:
  explicit Scene(std::vector<std::string> views)
      : synchroniser_(options(std::move(views)), [this](FrameMessages frame) { frames.push_back(std::move(frame)); }) {}

  void image(std::size_t view, double stamp, const std::optional<double>& held_for_s = std::nullopt) {
    auto message = boost::make_shared<sensor_msgs::Image>();
    message->header.stamp = ros::Time(stamp);
    message->header.frame_id = "view" + std::to_string(view);
    synchroniser_.addImage(view, message, now, held_for_s);
  }
  void info(std::size_t view, double stamp) {
    auto message = boost::make_shared<sensor_msgs::CameraInfo>();
    message->header.stamp = ros::Time(stamp);
    synchroniser_.addInfo(view, message);
  }
  void both(std::size_t view, double stamp) {
    info(view, stamp);
    image(view, stamp);
  }
  void pass(double seconds) {
    now += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    synchroniser_.expire(now);
  }
  void clear() { synchroniser_.clear(); }

  Clock::time_point now{};
  std::vector<FrameMessages> frames;

 private:
  static ViewSynchroniser::Options options(std::vector<std::string> views) {
    ViewSynchroniser::Options result;
    result.views = std::move(views);
    result.tolerance_s = 0.02;
    result.patience = std::chrono::milliseconds(250);
    return result;
  }
  ViewSynchroniser synchroniser_;
};

TEST(ViewSynchroniser, PairsInEitherOrder) {
  Scene scene({""});
  scene.both(0, 1.0);
  scene.image(0, 1.1);
  EXPECT_EQ(scene.frames.size(), 1U);
  scene.info(0, 1.1);
  ASSERT_EQ(scene.frames.size(), 2U);
  EXPECT_TRUE(scene.frames[1].complete());
  EXPECT_EQ(scene.frames[1].header.stamp, ros::Time(1.1));
  EXPECT_EQ(scene.frames[1].header.frame_id, "view0");
}

TEST(ViewSynchroniser, CarriesWhatIsKnownOfAnImage) {
  Scene scene({""});
  const Clock::time_point first = scene.now;
  scene.image(0, 1.0, 0.5);
  scene.pass(0.1);
  scene.info(0, 1.0);
  scene.info(0, 1.1);
  scene.image(0, 1.1, 0.6);
  scene.both(0, 1.2);
  ASSERT_EQ(scene.frames.size(), 3U);
  EXPECT_EQ(scene.frames[0].views[0].held_for_s, 0.5);
  EXPECT_EQ(scene.frames[0].arrived, first);
  EXPECT_EQ(scene.frames[1].views[0].held_for_s, 0.6);
  EXPECT_EQ(scene.frames[1].arrived, scene.now);
  EXPECT_FALSE(scene.frames[2].views[0].held_for_s);
}

TEST(ViewSynchroniser, ImageWithoutInfoIsGivenOutByTheNextPair) {
  Scene scene({""});
  scene.image(0, 1.0);
  scene.info(0, 1.0001);  // Stamps must be equal.
  scene.both(0, 1.1);
  ASSERT_EQ(scene.frames.size(), 2U);
  EXPECT_NE(scene.frames[0].views[0].problem.find("camera_info"), std::string::npos);
  EXPECT_EQ(scene.frames[0].header.stamp, ros::Time(1.0));
  EXPECT_TRUE(scene.frames[1].complete());
}

TEST(ViewSynchroniser, EveryImageComesOutWhenInfosNeverCome) {
  Scene scene({""});
  for (int i = 0; i < 10; ++i) scene.image(0, 1.0 + 0.1 * i);
  scene.pass(0.3);
  ASSERT_EQ(scene.frames.size(), 10U);
  for (const FrameMessages& frame : scene.frames) EXPECT_FALSE(frame.complete());
}

TEST(ViewSynchroniser, ViewsComeTogetherWithinTheTolerance) {
  Scene scene({"a", "b"});
  scene.both(1, 1.015);
  scene.both(0, 1.0);
  ASSERT_EQ(scene.frames.size(), 1U);
  EXPECT_TRUE(scene.frames[0].complete());
  EXPECT_EQ(scene.frames[0].header.stamp, ros::Time(1.0));  // The first view's.
}

TEST(ViewSynchroniser, ViewsBeyondTheToleranceAreTwoFrames) {
  Scene scene({"a", "b"});
  scene.both(0, 1.0);
  scene.both(1, 1.05);
  ASSERT_EQ(scene.frames.size(), 1U);  // View b has moved on: the first frame cannot be completed.
  EXPECT_FALSE(scene.frames[0].complete());
  EXPECT_NE(scene.frames[0].views[1].problem.find("20 ms"), std::string::npos);
  scene.pass(0.3);
  ASSERT_EQ(scene.frames.size(), 2U);
  EXPECT_EQ(scene.frames[1].header.frame_id, "view1");
}

TEST(ViewSynchroniser, OlderFramesGoFirst) {
  Scene scene({"a", "b"});
  scene.both(0, 1.0);
  scene.both(0, 1.1);
  scene.both(1, 1.1);
  ASSERT_EQ(scene.frames.size(), 2U);
  EXPECT_FALSE(scene.frames[0].complete());
  EXPECT_TRUE(scene.frames[1].complete());
}

TEST(ViewSynchroniser, WaitsNoLongerThanItsPatience) {
  Scene scene({"a", "b"});
  scene.both(0, 1.0);
  scene.pass(0.2);
  EXPECT_TRUE(scene.frames.empty());
  scene.pass(0.1);
  ASSERT_EQ(scene.frames.size(), 1U);
  EXPECT_TRUE(scene.frames[0].views[0].problem.empty());
}

TEST(ViewSynchroniser, ForgetsOnATimeJump) {
  Scene scene({"a", "b"});
  scene.both(0, 5.0);
  scene.image(1, 5.0);
  scene.clear();
  scene.both(0, 1.0);
  scene.both(1, 1.0);
  ASSERT_EQ(scene.frames.size(), 1U);
  EXPECT_TRUE(scene.frames[0].complete());
}

TEST(ViewSynchroniser, TakesAnyStamp) {
  Scene scene({"a", "b"});
  for (const double stamp : {4e9, 0.0, 3e9, 1.0}) {
    scene.both(0, stamp);
    scene.both(1, 4e9 - stamp);
  }
  scene.pass(1.0);
  std::size_t images = 0;
  for (const FrameMessages& frame : scene.frames) {
    for (const ViewMessage& view : frame.views) images += view.image ? 1U : 0U;
  }
  EXPECT_EQ(images, 8U);  // None lost, none twice.
}

}  // namespace
}  // namespace xray_registration
