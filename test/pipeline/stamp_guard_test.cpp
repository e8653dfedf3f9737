#include "xray_registration/pipeline/stamp_guard.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

namespace xray_registration {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

/// A camera and a node. The node's clock stands at 1000 s at first; frames come every 100 ms.
class Stream {
 public:
  explicit Stream(bool simulated = false) : guard(StampParameters{}, simulated) {}

  StampJudgement judge(nanoseconds stamp) {
    now += 100ms;
    at += 100ms;
    return guard.judge({stamp, now, at});
  }
  StampVerdict image(nanoseconds stamp) { return judge(stamp).verdict; }
  /// One that a camera takes whose clock is behind by so much.
  StampVerdict behind(nanoseconds offset) {
    now += 100ms;
    at += 100ms;
    return guard.judge({now - offset, now, at}).verdict;
  }
  /// One that was taken just now.
  StampVerdict live() { return guard.judge({now += 100ms, now, at += 100ms}).verdict; }

  StampGuard guard;
  nanoseconds now = 1000s;
  std::chrono::steady_clock::time_point at{50s};
};

TEST(StampGuard, TakesWhatIsInOrder) {
  Stream stream;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(stream.live(), StampVerdict::kNext);
}

TEST(StampGuard, RefusalsSayWhy) {
  Stream stream;
  stream.live();
  for (const nanoseconds stamp : std::vector<nanoseconds>{0s, 999s, 1000100ms, 4600s})
    EXPECT_NE(stream.judge(stamp).problem, "");
  EXPECT_EQ(stream.judge(stream.now + 100ms).problem, "");
  EXPECT_NE(stream.judge(4600s).problem.find("3599.3 s ahead"), std::string::npos) << stream.judge(4600s).problem;
}

TEST(StampGuard, ZeroStampsAndRepeatedOnesChangeNothing) {
  Stream stream;
  stream.live();
  const nanoseconds stamp = stream.now;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(stream.image(0s), StampVerdict::kNone);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(stream.image(stamp), StampVerdict::kRepeated);
  EXPECT_EQ(stream.live(), StampVerdict::kNext);
}

TEST(StampGuard, OneOrTwoBackChangeNothing) {
  for (const nanoseconds back : std::vector<nanoseconds>{250ms, 5s, 1000s}) {
    Stream stream;
    stream.live();
    EXPECT_EQ(stream.behind(back), StampVerdict::kBack);
    EXPECT_EQ(stream.live(), StampVerdict::kNext);
    EXPECT_EQ(stream.behind(back), StampVerdict::kBack);
    EXPECT_EQ(stream.behind(back + 100ms), StampVerdict::kBack);
    EXPECT_EQ(stream.live(), StampVerdict::kNext);
  }
}

TEST(StampGuard, AheadOfNowIsNeverTaken) {
  for (const bool simulated : {false, true}) {
    Stream stream(simulated);
    stream.live();
    for (int i = 0; i < 10; ++i) EXPECT_EQ(stream.image(stream.now + 3600s), StampVerdict::kAhead);
    EXPECT_EQ(stream.live(), StampVerdict::kNext);
    EXPECT_EQ(stream.image(stream.now + 400ms), StampVerdict::kNext);  // max_ahead is 0.5 s, and 0.1 s pass.
    EXPECT_EQ(stream.image(stream.now + 700ms), StampVerdict::kAhead);
  }
}

// A bag that is played without --clock: nothing is ahead of now, and an outlier is known beside the others alone.
TEST(StampGuard, OneJumpAheadChangesNothing) {
  Stream stream;
  EXPECT_EQ(stream.image(20s), StampVerdict::kNext);
  EXPECT_EQ(stream.image(500s), StampVerdict::kJumped);
  EXPECT_EQ(stream.image(20100ms), StampVerdict::kNext);
}

TEST(StampGuard, FirstOneThatLiesIsOvercome) {
  Stream stream;
  EXPECT_EQ(stream.image(500s), StampVerdict::kNext);
  EXPECT_EQ(stream.image(20s), StampVerdict::kBack);
  EXPECT_EQ(stream.image(20100ms), StampVerdict::kBack);
  EXPECT_EQ(stream.image(20200ms), StampVerdict::kClockSet);
  EXPECT_EQ(stream.image(20300ms), StampVerdict::kNext);
}

TEST(StampGuard, PauseIsNoJump) {
  Stream stream;
  stream.live();
  stream.at += 600s;
  stream.now += 600s;
  EXPECT_EQ(stream.live(), StampVerdict::kNext);
}

// A network that was cut for 3 s hands on what it kept, and what is too much for a queue is gone.
TEST(StampGuard, ImagesThatWaitedTogetherAreLateUntilTheyAreFresh) {
  Stream stream;
  stream.live();
  const nanoseconds cut = stream.now;
  stream.now += 3s;
  stream.at += 3s;
  const StampJudgement late = stream.judge(cut + 100ms);
  EXPECT_EQ(late.verdict, StampVerdict::kLate);
  EXPECT_NE(late.problem.find("3.0 s later"), std::string::npos) << late.problem;
  EXPECT_EQ(stream.image(cut + 200ms), StampVerdict::kLate);
  EXPECT_EQ(stream.image(cut + 2400ms), StampVerdict::kNext);  // 0.9 s old.
  EXPECT_EQ(stream.image(cut + 2300ms), StampVerdict::kBack);
  EXPECT_EQ(stream.live(), StampVerdict::kNext);
}

// However many they are, and however steadily they come: a queue that is full all the time.
TEST(StampGuard, LateImagesAreNeverTheNewOnes) {
  Stream stream;
  stream.live();
  stream.now += 6s;
  stream.at += 6s;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(stream.behind(5s), StampVerdict::kLate);
  EXPECT_EQ(stream.live(), StampVerdict::kNext);
}

TEST(StampGuard, LateIsMeasuredAgainstTheCamerasOwnClock) {
  Stream stream;
  for (int i = 0; i < 5; ++i) EXPECT_EQ(stream.behind(20s), StampVerdict::kNext);
  stream.now += 3s;
  stream.at += 3s;
  EXPECT_EQ(stream.behind(22s), StampVerdict::kLate);
  EXPECT_EQ(stream.behind(20500ms), StampVerdict::kNext);
}

// Nobody sets the camera's clock, which loses 17 s a day.
TEST(StampGuard, DriftIsNotLate) {
  Stream stream;
  nanoseconds lost = 0s;
  for (int minute = 0; minute < 24 * 60; ++minute) {
    stream.now += 60s;
    stream.at += 60s;
    ASSERT_EQ(stream.behind(lost += 12ms), StampVerdict::kNext) << minute;
  }
}

// A bag that is played at half its speed: without --clock, and with it.
TEST(StampGuard, SlowReplayIsNotLate) {
  for (const bool simulated : {false, true}) {
    Stream stream(simulated);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(stream.image((simulated ? 990s : 20s) + i * 50ms), StampVerdict::kNext);
  }
}

TEST(StampGuard, ConsistentRunIsANewRecordingInSimulatedTimeAlone) {
  for (const bool simulated : {false, true}) {
    Stream stream(simulated);
    stream.image(500s);
    EXPECT_EQ(stream.image(20s), StampVerdict::kBack);
    EXPECT_EQ(stream.image(20100ms), StampVerdict::kBack);
    EXPECT_EQ(stream.image(20200ms), simulated ? StampVerdict::kRecordingAgain : StampVerdict::kClockSet);
    EXPECT_EQ(stream.image(20300ms), StampVerdict::kNext);
    // Ahead is no recording that starts again.
    EXPECT_EQ(stream.image(400s), StampVerdict::kJumped);
    EXPECT_EQ(stream.image(400100ms), StampVerdict::kJumped);
    EXPECT_EQ(stream.image(400200ms), StampVerdict::kClockSet);
  }
}

TEST(StampGuard, RunIsOfStampsThatFollowEachOther) {
  Stream stream;
  stream.image(500s);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(stream.image(20s), StampVerdict::kBack);   // Not rising.
    EXPECT_EQ(stream.image(100s), StampVerdict::kBack);  // Not as time passes.
  }
}

// Two publishers, one 5 s behind: the one in front is followed, the other one refused.
TEST(StampGuard, LaggingPublisherIsRefusedAlways) {
  Stream stream;
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(stream.live(), StampVerdict::kNext);
    EXPECT_EQ(stream.behind(5s), StampVerdict::kBack);
  }
}

TEST(StampGuard, NtpStepOfTheCameraIsOvercome) {
  // By milliseconds: what is still newer than the last one is taken.
  Stream small;
  small.live();
  EXPECT_EQ(small.behind(30ms), StampVerdict::kNext);
  EXPECT_EQ(small.behind(150ms), StampVerdict::kBack);
  EXPECT_EQ(small.behind(150ms), StampVerdict::kNext);
  EXPECT_EQ(small.behind(0ms), StampVerdict::kNext);
  // By seconds.
  Stream large;
  large.live();
  for (const nanoseconds behind : std::vector<nanoseconds>{5s, 0s, 3s}) {
    const StampVerdict refused = behind > 0s ? StampVerdict::kBack : StampVerdict::kJumped;
    EXPECT_EQ(large.behind(behind), refused);
    EXPECT_EQ(large.behind(behind), refused);
    EXPECT_EQ(large.behind(behind), StampVerdict::kClockSet);
    EXPECT_EQ(large.behind(behind), StampVerdict::kNext);
  }
}

TEST(StampGuard, NtpStepOfTheNodeIsOvercome) {
  Stream stream;
  stream.live();
  const nanoseconds camera = stream.now;  // The camera's clock goes on.
  stream.now += 7s;                       // The node's was behind and is set.
  EXPECT_EQ(stream.image(camera + 100ms), StampVerdict::kNext);
  stream.now -= 14s;
  EXPECT_EQ(stream.image(camera + 200ms), StampVerdict::kAhead);
  stream.now += 7s;
  EXPECT_EQ(stream.image(camera + 400ms), StampVerdict::kNext);
}

TEST(StampGuard, CameraThatCountsFromItsStartIsFollowedAfterARestart) {
  Stream stream;
  for (int i = 1; i < 5; ++i) EXPECT_EQ(stream.image(300s + i * 100ms), StampVerdict::kNext);
  EXPECT_EQ(stream.image(100ms), StampVerdict::kBack);
  EXPECT_EQ(stream.image(200ms), StampVerdict::kBack);
  EXPECT_EQ(stream.image(300ms), StampVerdict::kClockSet);
  EXPECT_EQ(stream.image(400ms), StampVerdict::kNext);
}

TEST(StampGuard, LoopShorterThanASecondGoesOn) {
  Stream stream;
  int taken = 0;
  for (int loop = 0; loop < 5; ++loop) {
    for (int i = 0; i < 8; ++i) taken += stream.judge(20s + i * 100ms).problem.empty() ? 1 : 0;
  }
  EXPECT_EQ(taken, 8 + 4 * 6);  // Each time two are refused before the third is believed.
}

TEST(StampGuard, FastReplayIsInOrder) {
  Stream stream(true);
  nanoseconds stamp = stream.now;
  for (int i = 0; i < 5; ++i) {
    stream.now += 20s;
    stream.at += 100ms;
    EXPECT_EQ(stream.guard.judge({stamp += 20s, stream.now, stream.at}).verdict, StampVerdict::kNext);
  }
}

TEST(StampGuard, SimulatedTimeHasToBegin) {
  Stream stream(true);
  stream.now = -100ms;
  EXPECT_EQ(stream.image(20s), StampVerdict::kNoClock);
  Stream wall(false);
  wall.image(20s);
  EXPECT_EQ(wall.image(20100ms), StampVerdict::kNext);
}

TEST(StampGuard, ForgetsOnDemand) {
  Stream stream;
  stream.image(500s);
  stream.image(20s);
  stream.guard.forget();
  EXPECT_EQ(stream.image(21s), StampVerdict::kNext);
  EXPECT_EQ(stream.image(20s), StampVerdict::kBack);
}

}  // namespace
}  // namespace xray_registration
