#include "xray_registration/evaluation/trial_statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace xray_registration {
namespace {

Trial trial(double start_mm, double final_mm, double inplane_mm, bool accepted) {
  Trial made;
  made.start.mtre_mm = start_mm;
  made.final = {final_mm, inplane_mm};
  made.result.accepted = accepted;
  return made;
}

StartBin bin(double from_mm, int trials, int successes) { return {from_mm, from_mm + 2.0, trials, successes}; }

TEST(SuccessCriteria, OneViewForgivesDepthAndSeveralDoNot) {
  const SuccessCriteria one = successCriteria(1);
  EXPECT_TRUE(one.isSuccess({2.9, 0.4}));
  EXPECT_FALSE(one.isSuccess({2.9, 0.5}));
  EXPECT_FALSE(one.isSuccess({3.0, 0.4}));
  const SuccessCriteria two = successCriteria(2);
  EXPECT_TRUE(two.isSuccess({0.9, 0.9}));
  EXPECT_FALSE(two.isSuccess({1.0, 0.1}));
}

TEST(SuccessCriteria, VerdictIsJudgedAgainstTheTruth) {
  const SuccessCriteria one = successCriteria(1);
  EXPECT_TRUE(one.isFalseAcceptance(trial(9, 5.1, 0.1, true)));
  EXPECT_FALSE(one.isFalseAcceptance(trial(9, 5.1, 0.1, false)));
  EXPECT_FALSE(one.isFalseAcceptance(trial(9, 4.9, 0.1, true)));
  EXPECT_TRUE(successCriteria(2).isFalseAcceptance(trial(9, 2.1, 0.1, true)));
  EXPECT_TRUE(one.isFalseRefusal(trial(9, 0.3, 0.1, false)));
  EXPECT_FALSE(one.isFalseRefusal(trial(9, 0.3, 0.1, true)));
  EXPECT_FALSE(one.isFalseRefusal(trial(9, 7.0, 0.1, false)));
}

TEST(CaptureRange, EndsAtTheFirstBinThatFails) {
  EXPECT_DOUBLE_EQ(captureRange({bin(0, 20, 20), bin(2, 40, 38), bin(4, 40, 37), bin(6, 40, 40)}), 4.0);
  EXPECT_DOUBLE_EQ(captureRange({bin(0, 20, 18)}), 0.0);
  EXPECT_DOUBLE_EQ(captureRange({}), 0.0);
}

TEST(CaptureRange, ThinBinsAreJoinedAndNotForgotten) {
  // 3 + 9 + 10 trials make one judged bin of 6 mm.
  EXPECT_DOUBLE_EQ(captureRange({bin(0, 3, 3), bin(2, 9, 9), bin(4, 10, 10)}), 6.0);
  // Two failures in a thin bin count in the joined one.
  EXPECT_DOUBLE_EQ(captureRange({bin(0, 3, 1), bin(2, 20, 20), bin(4, 20, 20)}), 0.0);
  // Too few trials at the far end prove nothing.
  EXPECT_DOUBLE_EQ(captureRange({bin(0, 20, 20), bin(2, 19, 19)}), 2.0);
}

TEST(StatisticsOf, CountsEveryKind) {
  std::vector<Trial> trials = {trial(1, 0.2, 0.1, true), trial(3, 0.4, 0.1, false), trial(3.5, 6.0, 0.1, true),
                               trial(9, 20.0, 5.0, false)};
  trials[0].prepare_ms = 1.0;
  trials[0].solve_ms = 3.0;
  const TrialStatistics statistics = statisticsOf(trials, successCriteria(1));
  EXPECT_EQ(statistics.trials, 4);
  EXPECT_EQ(statistics.successes, 2);
  EXPECT_EQ(statistics.gross_failures, 1);
  EXPECT_EQ(statistics.accepted, 2);
  EXPECT_EQ(statistics.false_acceptances, 1);
  EXPECT_EQ(statistics.false_refusals, 1);
  EXPECT_DOUBLE_EQ(statistics.successRate(), 0.5);
  EXPECT_DOUBLE_EQ(statistics.falseAcceptanceRate(), 0.25);
  EXPECT_DOUBLE_EQ(statistics.falseRefusalRate(), 0.5);
  EXPECT_DOUBLE_EQ(statistics.final_mtre_mm.median, 3.2);
  EXPECT_DOUBLE_EQ(percentiles({0.0, 0.0, 0.0, 4.0}).p99, statistics.frame_ms.p99);
  ASSERT_EQ(statistics.bins.size(), 5U);
  EXPECT_EQ(statistics.bins[1].trials, 2);
  EXPECT_EQ(statistics.bins[1].successes, 1);
  EXPECT_EQ(statistics.bins[2].trials, 0);
}

TEST(StatisticsOf, InfiniteErrorIsGrossAndFalselyAccepted) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const TrialStatistics statistics = statisticsOf({trial(1, kInfinity, kInfinity, true)}, successCriteria(1));
  EXPECT_EQ(statistics.successes, 0);
  EXPECT_EQ(statistics.gross_failures, 1);
  EXPECT_EQ(statistics.false_acceptances, 1);
}

TEST(StatisticsOf, NothingGivesZeros) {
  const TrialStatistics statistics = statisticsOf({}, successCriteria(1));
  EXPECT_EQ(statistics.successRate(), 0.0);
  EXPECT_EQ(statistics.falseRefusalRate(), 0.0);
  EXPECT_TRUE(statistics.bins.empty());
}

}  // namespace
}  // namespace xray_registration
