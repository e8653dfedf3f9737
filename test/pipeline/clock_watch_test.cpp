#include "xray_registration/pipeline/clock_watch.h"

#include <gtest/gtest.h>

#include <chrono>

namespace xray_registration {
namespace {

using namespace std::chrono_literals;

TEST(ClockWatch, SimulatedTimeThatStartsAgainIsNoticedOnce) {
  ClockWatch watch(true);
  EXPECT_FALSE(watch.wentBack(100s));
  EXPECT_FALSE(watch.wentBack(101s));
  EXPECT_TRUE(watch.wentBack(10s));
  EXPECT_FALSE(watch.wentBack(10s));
  EXPECT_FALSE(watch.wentBack(10100ms));
}

TEST(ClockWatch, SimulatedTimeMayWaver) {
  ClockWatch watch(true);
  watch.wentBack(100s);
  EXPECT_FALSE(watch.wentBack(99950ms));
  EXPECT_FALSE(watch.wentBack(100010ms));
  EXPECT_FALSE(watch.wentBack(99920ms));
}

TEST(ClockWatch, SmallStepsBackAddUp) {
  ClockWatch watch(true);
  watch.wentBack(100s);
  EXPECT_FALSE(watch.wentBack(99950ms));
  EXPECT_TRUE(watch.wentBack(99890ms));
}

TEST(ClockWatch, TheWallsClockNeverGoesBack) {
  ClockWatch watch(false);
  for (const std::chrono::nanoseconds now : {1000000ms, 999999ms, 999000ms, 10000ms, 1000000ms, 0ms})
    EXPECT_FALSE(watch.wentBack(now));
}

}  // namespace
}  // namespace xray_registration
