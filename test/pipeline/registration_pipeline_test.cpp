// The pipeline's own behaviour, with a registrar that does what the test tells it.
#include "xray_registration/pipeline/registration_pipeline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <new>
#include <utility>

#include "test/pipeline/fake_registrar.h"
#include "xray_registration/volume/phantom.h"
#include "xray_registration/volume/volume_error.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration {
namespace {

class Pipeline : public testing::Test {
 protected:
  RegistrationPipeline make(const NodeParameters& parameters = {}) { return {parameters, fakes(&script_), {}}; }
  Script script_;
};

TEST_F(Pipeline, SaysWhatItWaitsFor) {
  RegistrationPipeline pipeline = make();
  EXPECT_EQ(pipeline.state(), TrackingState::kWaitingForCt);
  FrameOutcome outcome = pipeline.process(1.0, {someView()});
  EXPECT_FALSE(outcome.result.accepted);
  EXPECT_NE(outcome.result.reason.find("no CT"), std::string::npos);

  pipeline.setCt(whiteCube(16));
  EXPECT_EQ(pipeline.state(), TrackingState::kWaitingForPose);
  outcome = pipeline.process(1.0, {someView()});
  EXPECT_FALSE(outcome.registered);
  EXPECT_NE(outcome.result.reason.find("pose"), std::string::npos);

  pipeline.setPose(somePose());
  outcome = pipeline.process(1.1, {someView()});
  EXPECT_TRUE(outcome.result.accepted) << outcome.result.reason;
  EXPECT_TRUE(outcome.result.reason.empty());
  EXPECT_EQ(outcome.state, TrackingState::kTracking);
  EXPECT_EQ(pipeline.lastAcceptedStamp(), 1.1);

  pipeline.reset();
  EXPECT_EQ(pipeline.state(), TrackingState::kWaitingForPose);
  EXPECT_TRUE(pipeline.hasCt());
}

TEST_F(Pipeline, BadFramesAreRefusedWithTheReasonAndHarmNothing) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  std::vector<RawView> bad(6, someView());
  bad[0].calibration.k[0] = 0.0;
  bad[1].calibration.width = 0;
  bad[2].calibration.width = 64;
  bad[3].image->pixels = FloatImage(32, 24, 100.0F);
  bad[4].image->pixels.floats.at(3, 3) = std::numeric_limits<float>::quiet_NaN();
  bad[4].image->pixels.floats.at(9, 9) = std::numeric_limits<float>::infinity();
  bad[5].image.reset();
  bad[5].problem = "image encoding 'rgb8' is not one of mono8";
  double stamp = 1.0;
  for (const RawView& raw : bad) {
    const FrameOutcome outcome = pipeline.process(stamp += 0.1, {raw});
    EXPECT_FALSE(outcome.result.accepted) << "case " << &raw - bad.data();
    EXPECT_FALSE(outcome.result.reason.empty());
    EXPECT_FALSE(outcome.registered);
  }
  EXPECT_TRUE(pipeline.process(stamp + 0.1, {someView()}).result.accepted);
}

TEST_F(Pipeline, ARefusedFrameHasAReasonForEachBody) {
  NodeParameters parameters;
  for (const char* name : {"radius", "ulna"}) {
    const std::string path = testing::TempDir() + "/xray_pipeline_" + name + ".mha";
    writeVolume(whiteCube(16), path);
    parameters.bodies.emplace_back().name = name;
    parameters.bodies.back().ct = path;
  }
  RegistrationPipeline pipeline = make(parameters);
  pipeline.loadBodies();
  const auto expectBodies = [](const FrameOutcome& outcome, bool accepted) {
    ASSERT_EQ(outcome.result.bodies.size(), 2U);
    for (const BodyResult& body : outcome.result.bodies) {
      EXPECT_EQ(body.accepted, accepted) << body.name;
      EXPECT_EQ(body.reason.empty(), accepted) << body.name;
    }
    EXPECT_EQ(outcome.result.bodies[0].name, "radius");
    EXPECT_EQ(outcome.result.bodies[1].name, "ulna");
  };
  expectBodies(pipeline.process(1.0, {someView()}), false);  // No pose.
  pipeline.setPose(somePose());
  RawView bad = someView();
  bad.image.reset();
  expectBodies(pipeline.process(1.1, {bad}), false);
  expectBodies(pipeline.process(1.2, {someView()}), true);
}

TEST_F(Pipeline, ADeviceThatFailsOnceIsRebuilt) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  script_.failures_to_register = 1;
  const FrameOutcome failed = pipeline.process(1.0, {someView()});
  EXPECT_FALSE(failed.result.accepted);
  EXPECT_NE(failed.result.reason.find("device lost"), std::string::npos);
  EXPECT_EQ(script_.made, 2);
  EXPECT_NE(failed.state, TrackingState::kFault);
  EXPECT_TRUE(pipeline.process(1.1, {someView()}).result.accepted);
}

TEST_F(Pipeline, ADeviceThatFailsAgainIsAFaultUntilReset) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  script_.failures_to_register = 2;
  pipeline.process(1.0, {someView()});
  FrameOutcome outcome = pipeline.process(1.1, {someView()});
  EXPECT_EQ(outcome.state, TrackingState::kFault);
  outcome = pipeline.process(1.2, {someView()});
  EXPECT_EQ(outcome.state, TrackingState::kFault);
  EXPECT_NE(outcome.result.reason.find("device lost"), std::string::npos);
  pipeline.reset();
  pipeline.setPose(somePose());
  EXPECT_TRUE(pipeline.process(1.3, {someView()}).result.accepted);
}

TEST_F(Pipeline, ADeviceThatCannotBeRebuiltIsAFault) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  script_.failures_to_register = 1;
  script_.failures_to_make = 1;
  EXPECT_EQ(pipeline.process(1.0, {someView()}).state, TrackingState::kFault);
  EXPECT_NE(pipeline.fault().find("no device of that name"), std::string::npos);
}

TEST_F(Pipeline, NoDeviceAtTheStartIsAFault) {
  RegistrationPipeline pipeline = make();
  script_.failures_to_make = 1;
  EXPECT_THROW(pipeline.openDevice(), DeviceError);
  EXPECT_EQ(pipeline.state(), TrackingState::kFault);
}

TEST_F(Pipeline, NothingThatIsNotFiniteComesOut) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  script_.gives_nan = true;
  const FrameOutcome outcome = pipeline.process(1.0, {someView()});
  EXPECT_FALSE(outcome.result.accepted);
  EXPECT_FALSE(outcome.registered);
  EXPECT_TRUE(outcome.result.T_camera_ct.matrix().allFinite());
  // Nor does it become the next start.
  script_.gives_nan = false;
  EXPECT_TRUE(pipeline.process(1.1, {someView()}).result.accepted);
  EXPECT_TRUE(script_.last_start.isApprox(somePose()));
}

TEST_F(Pipeline, MissingViewsAreRefusedUnlessAllowed) {
  NodeParameters parameters;
  parameters.views = {"a", "b"};
  RawView missing;
  missing.name = "b";
  missing.problem = "no image came";
  {
    RegistrationPipeline pipeline = make(parameters);
    pipeline.setCt(whiteCube(16));
    pipeline.setPose(somePose());
    const FrameOutcome outcome = pipeline.process(1.0, {someView("a"), missing});
    EXPECT_FALSE(outcome.result.accepted);
    EXPECT_NE(outcome.result.reason.find("'b'"), std::string::npos);
    EXPECT_EQ(outcome.views_missing, std::vector<std::string>{"b"});
  }
  parameters.sync.allow_missing_view = true;
  RegistrationPipeline pipeline = make(parameters);
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  const FrameOutcome outcome = pipeline.process(1.0, {someView("a"), missing});
  EXPECT_TRUE(outcome.result.accepted);
  EXPECT_EQ(outcome.views_used, std::vector<std::string>{"a"});
  EXPECT_EQ(outcome.views_missing, std::vector<std::string>{"b"});
  // All gone is never allowed.
  RawView missing_a = missing;
  missing_a.name = "a";
  EXPECT_FALSE(pipeline.process(1.1, {missing_a, missing}).result.accepted);
}

TEST_F(Pipeline, WithoutItsFirstViewAFrameKeepsThePoseInTheFirstViewsFrame) {
  NodeParameters parameters;
  parameters.views = {"a", "b"};
  parameters.sync.allow_missing_view = true;
  RegistrationPipeline pipeline = make(parameters);
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  RawView missing;
  missing.name = "a";
  RawView second = someView("b");
  second.T_view_first.linear() = rotationFromVector(Eigen::Vector3d(0.0, M_PI / 2.0, 0.0));
  second.T_view_first.translation() = Eigen::Vector3d(-900.0, 0.0, 900.0);
  const FrameOutcome outcome = pipeline.process(1.0, {missing, second});
  ASSERT_TRUE(outcome.result.accepted) << outcome.result.reason;
  // The registrar sees the second view as the first one ...
  ASSERT_EQ(script_.last_views.size(), 1U);
  EXPECT_TRUE(script_.last_views[0].T_view_first.isApprox(RigidTransform::Identity()));
  EXPECT_TRUE(script_.last_start.isApprox(second.T_view_first * somePose()));
  // ... and the answer is in the first view's frame, with the covariance turned: a quarter turn about y swaps x and z.
  EXPECT_TRUE(outcome.result.T_camera_ct.isApprox(somePose(), 1e-9));
  EXPECT_NEAR(outcome.result.covariance(0, 0), 3.0, 1e-9);
  EXPECT_NEAR(outcome.result.covariance(2, 2), 1.0, 1e-9);
  EXPECT_NEAR(outcome.result.covariance(3, 3), 6.0, 1e-9);
}

TEST_F(Pipeline, NewTuningRebuildsOnlyWhereItMust) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setTuning({}, {});
  EXPECT_EQ(script_.made, 1);
  script_.takes_options = false;
  pipeline.setTuning({}, {});
  EXPECT_EQ(script_.made, 2);
  pipeline.setPose(somePose());
  EXPECT_TRUE(pipeline.process(1.0, {someView()}).result.accepted);
}

TEST_F(Pipeline, ACtThatDoesNotFitIsAFaultAndTheNextOneRecovers) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  ASSERT_TRUE(pipeline.process(1.0, {someView()}).result.accepted);

  script_.on_set_volume = [] { throw std::bad_alloc(); };
  EXPECT_THROW(pipeline.setCt(whiteCube(8)), DeviceError);
  EXPECT_EQ(pipeline.state(), TrackingState::kFault);
  pipeline.setPose(somePose());
  const FrameOutcome outcome = pipeline.process(1.1, {someView()});
  EXPECT_FALSE(outcome.registered);
  EXPECT_EQ(outcome.state, TrackingState::kFault);
  EXPECT_NE(outcome.result.reason.find("out of memory"), std::string::npos) << outcome.result.reason;
  EXPECT_TRUE(pipeline.renderDrr({32, 24, 1000.0, 1000.0, 15.5, 11.5}, somePose()).empty());
  EXPECT_EQ(pipeline.deviceBytes(), 0U);

  script_.on_set_volume = {};
  pipeline.setCt(whiteCube(16));
  EXPECT_EQ(pipeline.state(), TrackingState::kWaitingForPose);
  pipeline.setPose(somePose());
  EXPECT_TRUE(pipeline.process(1.2, {someView()}).result.accepted);
}

TEST_F(Pipeline, AResetAfterACtThatDidNotFitTriesAgain) {
  RegistrationPipeline pipeline = make();
  int uploads_to_fail = 2;
  script_.on_set_volume = [&uploads_to_fail] {
    if (uploads_to_fail-- > 0) throw std::bad_alloc();
  };
  EXPECT_THROW(pipeline.setCt(whiteCube(16)), DeviceError);
  pipeline.reset();
  pipeline.setPose(somePose());
  EXPECT_EQ(pipeline.process(1.0, {someView()}).state, TrackingState::kFault);
  pipeline.reset();
  pipeline.setPose(somePose());
  EXPECT_TRUE(pipeline.process(1.1, {someView()}).result.accepted);
}

TEST_F(Pipeline, ACtThatCannotBeReadLeavesTheOldOneAtWork) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  ASSERT_TRUE(pipeline.process(1.0, {someView()}).result.accepted);
  EXPECT_THROW(pipeline.loadCt("/nowhere/ct.nii.gz"), VolumeError);
  Volume empty;
  EXPECT_THROW(pipeline.setCt(empty), VolumeError);
  EXPECT_EQ(pipeline.state(), TrackingState::kTracking);
  EXPECT_TRUE(pipeline.process(1.1, {someView()}).result.accepted);
}

TEST_F(Pipeline, ACtIsMovedInAndKeptUntilItIsDropped) {
  RegistrationPipeline pipeline = make();
  Volume ct = whiteCube(16);
  const std::int16_t* voxels = ct.hu.data();
  pipeline.setCt(std::move(ct));
  ASSERT_TRUE(pipeline.ct());
  EXPECT_EQ(pipeline.ct()->hu.data(), voxels);
  pipeline.dropCt();
  EXPECT_FALSE(pipeline.ct());
  EXPECT_TRUE(pipeline.hasCt());
}

TEST_F(Pipeline, ImagesAreNotCopiedOnTheirWayToTheSolverAndTheOverlay) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  std::vector<RawView> views = {someView()};
  const float* pixels = views[0].image->pixels.floats.pixels.data();
  const FrameOutcome outcome = pipeline.process(1.0, std::move(views));
  ASSERT_TRUE(outcome.views.at(0));
  EXPECT_EQ(outcome.views[0]->xray->attenuation.plain()->pixels.data(), pixels);
  EXPECT_EQ(script_.last_views.at(0).xray, outcome.views[0]->xray);
}

TEST_F(Pipeline, AfterARebuildTheFirstFrameIsAColdStartFromTheLastPose) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose(5.0));
  ASSERT_TRUE(pipeline.process(1.0, {someView()}).result.accepted);
  EXPECT_TRUE(script_.last_was_empty);
  ASSERT_TRUE(pipeline.process(1.1, {someView()}).result.accepted);
  EXPECT_FALSE(script_.last_was_empty);

  script_.failures_to_register = 1;
  EXPECT_FALSE(pipeline.process(1.2, {someView()}).result.accepted);
  EXPECT_EQ(pipeline.lastAcceptedStamp(), 1.1);
  ASSERT_TRUE(pipeline.process(1.3, {someView()}).result.accepted);
  EXPECT_TRUE(script_.last_was_empty) << "a registrar that has learnt nothing must not be told to track";
  EXPECT_TRUE(script_.last_start.isApprox(somePose(5.0)));
}

TEST_F(Pipeline, APictureThatBreaksTheDeviceCostsOneRebuildAndNoPose) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose(5.0));
  ASSERT_TRUE(pipeline.process(1.0, {someView()}).result.accepted);
  script_.failures_to_render = 1;
  const XrayCamera camera{32, 24, 1000.0, 1000.0, 15.5, 11.5};
  EXPECT_TRUE(pipeline.renderDrr(camera, somePose()).empty());
  EXPECT_FALSE(pipeline.renderDrr(camera, somePose()).empty());
  ASSERT_TRUE(pipeline.process(1.1, {someView()}).result.accepted);
  EXPECT_TRUE(script_.last_was_empty);
  EXPECT_TRUE(script_.last_start.isApprox(somePose(5.0)));
}

TEST_F(Pipeline, WhatEarlierFramesTaughtGoesWithThePose) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  const auto nextIsCold = [&](double stamp_s) {
    pipeline.process(stamp_s, {someView()});
    return script_.last_was_empty;
  };
  pipeline.setPose(somePose());
  EXPECT_TRUE(nextIsCold(1.0));
  EXPECT_FALSE(nextIsCold(1.1));
  pipeline.setPose(somePose());
  EXPECT_TRUE(nextIsCold(1.2));
  pipeline.reset();
  pipeline.setPose(somePose());
  EXPECT_TRUE(nextIsCold(1.3));
  const int before = script_.forgotten;
  pipeline.setCt(whiteCube(8));
  EXPECT_GT(script_.forgotten, before);
}

TEST_F(Pipeline, AStartThatTheMethodRefusesIsNotRegistered) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  script_.solves = false;
  const FrameOutcome outcome = pipeline.process(1.0, {someView()});
  EXPECT_FALSE(outcome.registered);
  EXPECT_FALSE(outcome.result.accepted);
  EXPECT_EQ(outcome.result.reason, "the start is of no use");
  script_.solves = true;
  EXPECT_TRUE(pipeline.process(1.1, {someView()}).registered);
}

TEST(PipelineWithThePapersMethod, ARefusedStartIsNotRegistered) {
  NodeParameters parameters;
  parameters.registrar.method = Method::kPaper;
  parameters.device = "cpu";
  parameters.views = {"a", "b"};
  RegistrationPipeline pipeline(parameters);
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(somePose());
  const FrameOutcome outcome = pipeline.process(1.0, {someView("a"), someView("b")});
  EXPECT_NE(outcome.result.reason.find("one view"), std::string::npos) << outcome.result.reason;
  EXPECT_FALSE(outcome.registered);
}

}  // namespace
}  // namespace xray_registration
