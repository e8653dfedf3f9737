#include "registration/step_budget.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(StepBudget, GivesWhatItHasAndRemembersThatMoreWasAsked) {
  StepBudget budget(2);
  EXPECT_TRUE(budget.draw());
  EXPECT_TRUE(budget.draw());
  EXPECT_FALSE(budget.exceeded());  // Used up is not exceeded.
  EXPECT_FALSE(budget.draw());
  EXPECT_TRUE(budget.exceeded());
  EXPECT_EQ(budget.used(), 2);
  EXPECT_EQ(budget.allowed(), 2);
}

}  // namespace
}  // namespace xray_registration
