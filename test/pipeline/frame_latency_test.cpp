#include "xray_registration/pipeline/frame_latency.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

TEST(FrameLatency, IsSinceTheStamp) {
  EXPECT_EQ(frameLatency(true, 0.2, 0.1), 0.2);
  EXPECT_EQ(frameLatency(true, 30.0, 0.1), 30.0);  // A network that was cut: old images are old.
  EXPECT_EQ(frameLatency(true, -0.1, 0.1), -0.1);  // Clocks that disagree are seen.
}

TEST(FrameLatency, IsSinceTheArrivalWhereStampsAreOfAnotherClock) {
  EXPECT_EQ(frameLatency(true, 1.7e9, 0.1), 0.1);
  EXPECT_EQ(frameLatency(false, 0.2, 0.1), 0.1);
}

}  // namespace
}  // namespace xray_registration
