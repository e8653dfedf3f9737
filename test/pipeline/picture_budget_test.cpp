#include "xray_registration/pipeline/picture_budget.h"

#include <gtest/gtest.h>

#include <cmath>

namespace xray_registration {
namespace {

using Clock = PictureBudget::Clock;

Clock::time_point at(double milliseconds) {
  return Clock::time_point(std::chrono::hours(1)) + std::chrono::microseconds(std::lround(1000.0 * milliseconds));
}

/// Frames every `period_ms`, the last one at 0; a picture that took 15 ms ended at `last_end_ms`.
void prepare(double period_ms, double last_end_ms, PictureBudget* budget) {
  for (int i = 12; i >= 0; --i) budget->frameCame(at(-period_ms * i));
  budget->made(at(last_end_ms - 15.0), at(last_end_ms));
}

TEST(PictureBudget, TheFirstPictureIsMadeAtOnce) {
  PictureBudget budget;
  budget.frameCame(at(0.0));
  EXPECT_EQ(budget.due(at(0.0), at(30.0)), at(30.0));
}

TEST(PictureBudget, WhatIsDoneBeforeTheNextFrameIsMadeAtOnce) {
  PictureBudget budget;
  prepare(100.0, -60.0, &budget);
  EXPECT_EQ(budget.due(at(0.0), at(30.0)), at(30.0));
  EXPECT_EQ(budget.due(at(0.0), at(85.0)), at(85.0));
}

TEST(PictureBudget, WhatWouldKeepAFrameWaitingTakesATenthOfTheTime) {
  PictureBudget budget;
  prepare(40.0, -20.0, &budget);
  EXPECT_EQ(budget.due(at(0.0), at(30.0)), at(-20.0 + 9.0 * 15.0));
  EXPECT_EQ(budget.due(at(0.0), at(200.0)), at(200.0));
}

TEST(PictureBudget, AFrameThatIsThereAlreadyIsNotMadeToWait) {
  PictureBudget budget;
  prepare(100.0, -60.0, &budget);
  budget.frameCame(at(29.0));
  EXPECT_EQ(budget.due(at(0.0), at(30.0)), at(-60.0 + 9.0 * 15.0));
}

TEST(PictureBudget, AFrameThatComesLateDoesNotChangeTheRate) {
  PictureBudget budget;
  prepare(40.0, -20.0, &budget);
  budget.frameCame(at(1000.0));
  EXPECT_GT(budget.due(at(1000.0), at(1030.0)), at(1000.0));
}

TEST(PictureBudget, WhatAPictureTookFades) {
  PictureBudget budget;
  prepare(40.0, -20.0, &budget);
  budget.made(at(-15.0), at(-14.0));
  EXPECT_EQ(budget.due(at(0.0), at(30.0)), at(-14.0 + 9.0 * 0.8 * 15.0));
}

}  // namespace
}  // namespace xray_registration
