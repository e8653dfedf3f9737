#include "xray_registration/pipeline/stamp_order.h"

#include <gtest/gtest.h>

#include <chrono>

namespace xray_registration {
namespace {

using namespace std::chrono_literals;

TEST(StampOrder, TellsWhatCannotBeHandled) {
  for (const bool simulated : {false, true}) {
    StampOrder order(simulated);
    EXPECT_EQ(order.judge(0s), StampVerdict::kNone);
    EXPECT_EQ(order.judge(50s), StampVerdict::kNext);
    EXPECT_EQ(order.judge(50s), StampVerdict::kRepeated);
    EXPECT_EQ(order.judge(49500ms), StampVerdict::kLate);
    EXPECT_EQ(order.judge(49900ms), StampVerdict::kLate);  // A late one is not what others are measured by.
    EXPECT_EQ(order.judge(0s), StampVerdict::kNone);
    EXPECT_EQ(order.judge(50100ms), StampVerdict::kNext);
  }
}

TEST(StampOrder, OnlySimulatedTimeStartsAgain) {
  StampOrder simulated(true);
  simulated.judge(50s);
  EXPECT_EQ(simulated.judge(10s), StampVerdict::kRecordingAgain);
  EXPECT_EQ(simulated.judge(10100ms), StampVerdict::kNext);

  StampOrder wall(false);
  wall.judge(50s);
  EXPECT_EQ(wall.judge(48s), StampVerdict::kClockSetBack);
  EXPECT_EQ(wall.judge(48100ms), StampVerdict::kNext);
}

TEST(StampOrder, ForgetsOnDemand) {
  StampOrder order(true);
  order.judge(50s);
  order.forget();
  EXPECT_EQ(order.judge(50s), StampVerdict::kNext);
}

}  // namespace
}  // namespace xray_registration
