#include "xray_registration/ros/clock_watch.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(ClockWatch, SimulatedTimeThatStartsAgainIsNoticedOnce) {
  ClockWatch watch(true);
  EXPECT_FALSE(watch.wentBack(ros::Time(100.0)));
  EXPECT_FALSE(watch.wentBack(ros::Time(101.0)));
  EXPECT_TRUE(watch.wentBack(ros::Time(10.0)));
  EXPECT_FALSE(watch.wentBack(ros::Time(10.0)));
  EXPECT_FALSE(watch.wentBack(ros::Time(10.1)));
}

TEST(ClockWatch, SimulatedTimeMayWaver) {
  ClockWatch watch(true);
  watch.wentBack(ros::Time(100.0));
  EXPECT_FALSE(watch.wentBack(ros::Time(99.95)));
  EXPECT_FALSE(watch.wentBack(ros::Time(100.01)));
  EXPECT_FALSE(watch.wentBack(ros::Time(99.92)));
}

TEST(ClockWatch, SmallStepsBackAddUp) {
  ClockWatch watch(true);
  watch.wentBack(ros::Time(100.0));
  EXPECT_FALSE(watch.wentBack(ros::Time(99.95)));
  EXPECT_TRUE(watch.wentBack(ros::Time(99.89)));
}

TEST(ClockWatch, TheWallsClockNeverGoesBack) {
  ClockWatch watch(false);
  for (const double now : {1000.0, 999.9999, 999.0, 10.0, 1000.0, 0.0}) EXPECT_FALSE(watch.wentBack(ros::Time(now)));
}

}  // namespace
}  // namespace xray_registration
