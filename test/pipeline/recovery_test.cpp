#include "xray_registration/pipeline/recovery.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

using Step = Recovery::Step;

TEST(Recovery, OnlyWhatIsLostIsRecovered) {
  Recovery recovery;
  for (int i = 0; i < 10; ++i) recovery.note(false);
  for (const Recover recover : {Recover::kOff, Recover::kLocal, Recover::kWide}) {
    EXPECT_EQ(recovery.next(recover, TrackingState::kTracking), Step::kRegister);
    EXPECT_EQ(recovery.next(recover, TrackingState::kWaitingForPose), Step::kRegister);
  }
  EXPECT_EQ(recovery.next(Recover::kOff, TrackingState::kLost), Step::kWait);
  EXPECT_EQ(recovery.next(Recover::kLocal, TrackingState::kLost), Step::kRegister);
  EXPECT_EQ(recovery.next(Recover::kWide, TrackingState::kLost), Step::kSearch);
}

TEST(Recovery, LooksNearbyFirstAndAgainAfterASearch) {
  Recovery recovery;
  int tries = 0;
  for (; recovery.next(Recover::kWide, TrackingState::kLost) == Step::kRegister; ++tries) recovery.note(false);
  EXPECT_GT(tries, 0);
  recovery.searched();
  EXPECT_EQ(recovery.next(Recover::kWide, TrackingState::kLost), Step::kRegister);
  for (int i = 0; i < tries; ++i) recovery.note(false);
  EXPECT_EQ(recovery.next(Recover::kWide, TrackingState::kLost), Step::kSearch);
  recovery.note(true);
  EXPECT_EQ(recovery.next(Recover::kWide, TrackingState::kLost), Step::kRegister);
}

}  // namespace
}  // namespace xray_registration
