// Wide searches of the pipeline, with a registrar that does what the test tells it.
#include <gtest/gtest.h>

#include "test/pipeline/fake_registrar.h"
#include "xray_registration/pipeline/registration_pipeline.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

class PipelineSearchTest : public testing::Test {
 protected:
  PipelineSearchTest() {
    script_.places = {somePose(50.0), somePose(-50.0)};
    parameters_.tracker.frames_until_lost = 2;
    parameters_.recover = Recover::kWide;
  }

  RegistrationPipeline make() { return {parameters_, fakes(&script_), {}}; }

  static void runThrough(RegistrationPipeline* pipeline) {
    while (pipeline->advanceSearch()) {
    }
  }

  Script script_;
  NodeParameters parameters_;
};

double placeOf(const std::optional<RigidTransform>& pose) { return pose ? pose->translation().x() : -1e9; }

TEST_F(PipelineSearchTest, WhatIsFoundIsTrackedFrom) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  ASSERT_EQ(pipeline.beginSearch(1.0, {someView()}, {}), "");
  EXPECT_TRUE(pipeline.advanceSearch());
  EXPECT_NEAR(pipeline.searchProgress(), 1.0 / 3.0, 1e-12);
  EXPECT_EQ(pipeline.searchBestSimilarity(), 0.5);
  runThrough(&pipeline);
  const FrameOutcome outcome = pipeline.finishSearch();
  EXPECT_TRUE(outcome.result.accepted) << outcome.result.reason;
  EXPECT_TRUE(outcome.registered);
  EXPECT_EQ(script_.last_places.size(), 2U);
  EXPECT_EQ(pipeline.state(), TrackingState::kTracking);
  EXPECT_EQ(placeOf(pipeline.prediction(1.0)), 50.0);
  EXPECT_EQ(pipeline.lastAcceptedStamp(), 1.0);
  EXPECT_EQ(script_.searches_alive, 0);
}

TEST_F(PipelineSearchTest, WhatIsRefusedChangesNothing) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose(7.0));
  ASSERT_TRUE(pipeline.process(1.0, {someView()}).result.accepted);
  ASSERT_EQ(pipeline.beginSearch(2.0, {someView()}, {}), "");
  runThrough(&pipeline);
  script_.accepts = false;
  const FrameOutcome refused = pipeline.finishSearch();
  EXPECT_FALSE(refused.result.accepted);
  EXPECT_FALSE(refused.result.reason.empty());
  EXPECT_EQ(pipeline.state(), TrackingState::kTracking);
  EXPECT_EQ(placeOf(pipeline.prediction(2.0)), 7.0);
  EXPECT_EQ(pipeline.lastAcceptedStamp(), 1.0);
}

TEST_F(PipelineSearchTest, WhatNobodyWaitsForAnyMoreChangesNothing) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  ASSERT_EQ(pipeline.beginSearch(1.0, {someView()}, {}), "");
  runThrough(&pipeline);
  const FrameOutcome ended = pipeline.finishSearch([] { return false; });
  EXPECT_FALSE(ended.result.accepted);
  EXPECT_FALSE(pipeline.hasStart(1.0));
}

TEST_F(PipelineSearchTest, SaysWhyItCannotBegin) {
  RegistrationPipeline pipeline = make();
  EXPECT_NE(pipeline.beginSearch(1.0, {someView()}, {}).find("no CT"), std::string::npos);
  pipeline.setCt(whiteCube(16));
  RawView bad = someView();
  bad.calibration.k[0] = 0.0;
  EXPECT_NE(pipeline.beginSearch(1.0, {bad}, {}), "");
  script_.search_slices = -1;
  EXPECT_NE(pipeline.beginSearch(1.0, {someView()}, {}).find("method"), std::string::npos);
  EXPECT_FALSE(pipeline.advanceSearch());
  EXPECT_FALSE(pipeline.finishSearch().result.reason.empty());
}

TEST_F(PipelineSearchTest, EndsWithWhatItStandsOn) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  const std::vector<std::function<void()>> ends = {
      [&] { pipeline.setCt(whiteCube(16)); },
      [&] { pipeline.reset(); },
      [&] { pipeline.setTuning({}, parameters_.tracker); },
      [&] { pipeline.setPose(somePose()); },
  };
  for (const std::function<void()>& end : ends) {
    ASSERT_EQ(pipeline.beginSearch(1.0, {someView()}, {}), "");
    EXPECT_EQ(script_.searches_alive, 1);
    end();
    EXPECT_EQ(script_.searches_alive, 0);
    EXPECT_FALSE(pipeline.advanceSearch());
    EXPECT_NE(pipeline.finishSearch().result.reason.find("ended"), std::string::npos);
  }
}

TEST_F(PipelineSearchTest, ADeviceThatFailsIsSaidAndOpenedAnew) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  ASSERT_EQ(pipeline.beginSearch(1.0, {someView()}, {}), "");
  script_.failures_to_search = 1;
  runThrough(&pipeline);
  EXPECT_EQ(script_.searches_alive, 0);
  EXPECT_NE(pipeline.finishSearch().result.reason.find("device"), std::string::npos);
  ASSERT_EQ(pipeline.beginSearch(2.0, {someView()}, {}), "");
  runThrough(&pipeline);
  EXPECT_TRUE(pipeline.finishSearch().result.accepted);
}

TEST_F(PipelineSearchTest, WhatIsLostIsSearchedForInSlicesAroundWhereItWas) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose(7.0));
  ASSERT_TRUE(pipeline.process(1.0, {someView()}).result.accepted);
  script_.accepts = false;
  double stamp_s = 1.1;
  for (int i = 0; i < 20 && script_.last_places.empty(); ++i) pipeline.process(stamp_s += 0.1, {someView()});
  ASSERT_TRUE(script_.last_range);
  EXPECT_EQ(placeOf(script_.last_range->T_camera_ct_centre), 7.0);
  ASSERT_EQ(script_.last_places.size(), 2U);
  EXPECT_EQ(pipeline.state(), TrackingState::kLost);
  // Nothing was accepted there: from where it was last seen again.
  pipeline.process(stamp_s += 0.1, {someView()});
  EXPECT_EQ(script_.last_start.translation().x(), 7.0);
  script_.accepts = true;
  EXPECT_TRUE(pipeline.process(stamp_s += 0.1, {someView()}).result.accepted);
  EXPECT_EQ(pipeline.state(), TrackingState::kTracking);
}

TEST_F(PipelineSearchTest, RecoveryThatIsOffWaitsForAPose) {
  parameters_.recover = Recover::kOff;
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose(7.0));
  ASSERT_TRUE(pipeline.process(1.0, {someView()}).result.accepted);
  script_.accepts = false;
  pipeline.process(1.1, {someView()});
  pipeline.process(1.2, {someView()});
  ASSERT_EQ(pipeline.state(), TrackingState::kLost);
  script_.accepts = true;
  const FrameOutcome waiting = pipeline.process(1.3, {someView()});
  EXPECT_FALSE(waiting.registered);
  EXPECT_NE(waiting.result.reason.find("tracking/recover"), std::string::npos);
  pipeline.setPose(somePose(3.0));
  EXPECT_TRUE(pipeline.process(1.4, {someView()}).result.accepted);
}

}  // namespace
}  // namespace xray_registration
