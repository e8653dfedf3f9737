#include "xray_registration/ros/stamp_order.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(StampOrder, TellsWhatCannotBeHandled) {
  for (const bool simulated : {false, true}) {
    StampOrder order(simulated);
    EXPECT_EQ(order.judge(ros::Time()), StampVerdict::kNone);
    EXPECT_EQ(order.judge(ros::Time(50.0)), StampVerdict::kNext);
    EXPECT_EQ(order.judge(ros::Time(50.0)), StampVerdict::kRepeated);
    EXPECT_EQ(order.judge(ros::Time(49.5)), StampVerdict::kLate);
    EXPECT_EQ(order.judge(ros::Time(49.9)), StampVerdict::kLate);  // A late one is not what others are measured by.
    EXPECT_EQ(order.judge(ros::Time()), StampVerdict::kNone);
    EXPECT_EQ(order.judge(ros::Time(50.1)), StampVerdict::kNext);
  }
}

TEST(StampOrder, OnlySimulatedTimeStartsAgain) {
  StampOrder simulated(true);
  simulated.judge(ros::Time(50.0));
  EXPECT_EQ(simulated.judge(ros::Time(10.0)), StampVerdict::kRecordingAgain);
  EXPECT_EQ(simulated.judge(ros::Time(10.1)), StampVerdict::kNext);

  StampOrder wall(false);
  wall.judge(ros::Time(50.0));
  EXPECT_EQ(wall.judge(ros::Time(48.0)), StampVerdict::kClockSetBack);
  EXPECT_EQ(wall.judge(ros::Time(48.1)), StampVerdict::kNext);
}

TEST(StampOrder, ForgetsOnDemand) {
  StampOrder order(true);
  order.judge(ros::Time(50.0));
  order.forget();
  EXPECT_EQ(order.judge(ros::Time(50.0)), StampVerdict::kNext);
}

}  // namespace
}  // namespace xray_registration
