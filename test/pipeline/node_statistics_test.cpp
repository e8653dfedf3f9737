#include "xray_registration/pipeline/node_statistics.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(NodeStatistics, KnowsNoAgeBeforeTheFirst) {
  const NodeStatistics statistics;
  EXPECT_FALSE(statistics.snapshot().image_age_s);
  EXPECT_FALSE(statistics.snapshot().pose_age_s);
  EXPECT_GE(statistics.snapshot().uptime_s, 0.0);
  EXPECT_EQ(statistics.snapshot().dropped_share, 0.0);
}

TEST(NodeStatistics, TellsAgesRatesAndWhatWasDropped) {
  NodeStatistics statistics;
  for (int i = 0; i < 4; ++i) statistics.frameReceived();
  statistics.frameDropped();
  statistics.frameRefused("why");
  EXPECT_FALSE(statistics.snapshot().pose_age_s);
  statistics.frameAccepted(0.1, 20.0);
  const NodeStatistics::Snapshot values = statistics.snapshot();
  ASSERT_TRUE(values.image_age_s && values.pose_age_s);
  EXPECT_GE(*values.image_age_s, *values.pose_age_s);
  EXPECT_DOUBLE_EQ(values.received_hz, 4.0 / 5.0);  // Over five seconds.
  EXPECT_DOUBLE_EQ(values.rate_hz, 1.0 / 5.0);
  EXPECT_DOUBLE_EQ(values.dropped_share, 0.25);
  EXPECT_EQ(values.last_refusal, "why");
}

}  // namespace
}  // namespace xray_registration
