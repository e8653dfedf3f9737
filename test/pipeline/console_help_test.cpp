#include "xray_registration/pipeline/console_help.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

using namespace std::chrono_literals;

/// A node that is asked every second.
class Console {
 public:
  Console() {
    facts.inputs = {{"/image_raw", "/camera_info", 1, 0, 0}};
    facts.state = TrackingState::kTracking;
    facts.initialpose_topic = "/initialpose";
    facts.set_initial_pose_service = "/node/set_initial_pose";
  }

  /// What is said while so many seconds pass; `images`, `infos`: come in each of them.
  std::vector<std::string> pass(int seconds, int images, int infos) {
    std::vector<std::string> said;
    for (int i = 0; i < seconds; ++i) {
      facts.inputs[0].images += static_cast<std::uint64_t>(images);
      facts.inputs[0].infos += static_cast<std::uint64_t>(infos);
      for (const std::string& line : help.advise(facts, now += 1s, [this] { return topics; })) said.push_back(line);
    }
    return said;
  }

  ConsoleHelp help;
  ConsoleFacts facts;
  ConsoleHelp::Clock::time_point now{100s};
  std::vector<std::string> topics;
};

void expectOne(const std::vector<std::string>& said, const std::vector<const char*>& words) {
  ASSERT_EQ(said.size(), 1U);
  for (const char* word : words) EXPECT_NE(said[0].find(word), std::string::npos) << said[0];
}

TEST(ConsoleHelp, SaysNothingWhileAllIsWell) {
  Console console;
  EXPECT_TRUE(console.pass(1000, 15, 15).empty());
}

TEST(ConsoleHelp, NamesTopicsThatAreLikeTheSilentOne) {
  Console console;
  console.facts.inputs[0].image_publishers = 0;
  console.topics = {"/room/image_raw", "/carm/image_raw", "/image_raw"};
  EXPECT_TRUE(console.pass(5, 0, 0).empty());  // Not before its time.
  expectOne(console.pass(1000, 0, 0),
            {"/image_raw: nobody publishes", "/carm/image_raw, /room/image_raw", "image:=/carm/image_raw"});
}

TEST(ConsoleHelp, TellsAPublisherThatIsSilent) {
  Console console;
  expectOne(console.pass(10, 0, 0), {"no image comes on /image_raw", "publishes"});
  Console alone;
  alone.facts.inputs[0].image_publishers = 0;
  expectOne(alone.pass(10, 0, 0), {"nobody", "no other topic"});
}

TEST(ConsoleHelp, SaysItAgainInAnotherEpisodeAfterAWhile) {
  Console console;
  EXPECT_EQ(console.pass(10, 0, 0).size(), 1U);
  EXPECT_TRUE(console.pass(10, 15, 15).empty());
  EXPECT_TRUE(console.pass(10, 0, 0).empty());  // Within the pause.
  EXPECT_TRUE(console.pass(60, 15, 15).empty());
  EXPECT_EQ(console.pass(10, 0, 0).size(), 1U);
}

TEST(ConsoleHelp, OnDemandImagesMayPause) {
  Console console;
  console.facts.tracks = false;
  EXPECT_EQ(console.pass(10, 0, 0).size(), 1U);  // None has come yet.
  EXPECT_TRUE(console.pass(100, 1, 1).empty());
  EXPECT_TRUE(console.pass(100, 0, 0).empty());
}

TEST(ConsoleHelp, MissesCameraInfo) {
  Console console;
  expectOne(console.pass(20, 15, 0), {"/image_raw", "no camera_info on /camera_info"});
}

TEST(ConsoleHelp, NamesTheThreeWaysToGiveAStart) {
  Console console;
  console.facts.state = TrackingState::kWaitingForPose;
  expectOne(console.pass(20, 15, 15), {"initial_pose:=", "topic /initialpose", "service /node/set_initial_pose"});
}

TEST(ConsoleHelp, TellsOfTwoPublishersAndOfAClockThatStands) {
  Console console;
  console.facts.inputs[0].image_publishers = 2;
  expectOne(console.pass(20, 15, 15), {"2 nodes publish on /image_raw"});
  Console simulated;
  simulated.facts.waits_for_clock = true;
  expectOne(simulated.pass(20, 15, 15), {"/clock", "--clock"});
}

}  // namespace
}  // namespace xray_registration
