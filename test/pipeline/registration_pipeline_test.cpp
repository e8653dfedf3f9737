// The pipeline's own behaviour, with a registrar that does what the test tells it.
#include "xray_registration/pipeline/registration_pipeline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "xray_registration/drr/device.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

/// What the fake registrars of one test share.
struct Script {
  int made = 0;
  int failures_to_make = 0;
  int failures_to_register = 0;
  bool accepts = true;
  bool gives_nan = false;
  bool takes_options = true;
  std::vector<ViewInput> last_views;
  RigidTransform last_start = RigidTransform::Identity();
};

class FakeRegistrar : public Registrar {
 public:
  explicit FakeRegistrar(Script* script) : script_(script) {
    ++script_->made;
    if (script_->failures_to_make > 0) {
      --script_->failures_to_make;
      throw DeviceError("no device of that name", -1);
    }
  }
  void setVolume(const AttenuationVolume&) override { has_volume_ = true; }
  bool hasVolume() const override { return has_volume_; }
  RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& start, bool) override {
    script_->last_views = views;
    script_->last_start = start;
    if (script_->failures_to_register > 0) {
      --script_->failures_to_register;
      throw DeviceError("device lost", -5);
    }
    RegistrationResult result;
    result.accepted = script_->accepts;
    if (!result.accepted) result.reason = "the similarity is too low";
    result.T_camera_ct = start;
    if (script_->gives_nan) result.T_camera_ct.translation().x() = std::numeric_limits<double>::quiet_NaN();
    result.covariance.diagonal() << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0;
    return result;
  }
  FloatImage renderDrr(const XrayCamera& camera, const RigidTransform&) override {
    return FloatImage(camera.width, camera.height);
  }
  Eigen::Vector3d centreCt() const override { return Eigen::Vector3d::Zero(); }
  bool setOptions(const RegistrarOptions&) override { return script_->takes_options; }
  std::string deviceName() const override { return "fake"; }
  std::size_t deviceBytes() const override { return 1; }

 private:
  Script* script_;
  bool has_volume_ = false;
};

class Pipeline : public testing::Test {
 protected:
  RegistrationPipeline make(const NodeParameters& parameters = {}) {
    return {parameters, [this](const RegistrarOptions&) { return std::make_unique<FakeRegistrar>(&script_); }, {}};
  }
  static RawView view(const std::string& name = "") {
    RawView raw;
    raw.name = name;
    raw.image = RawImage{FloatImage(32, 24), 65535.0};
    for (std::size_t i = 0; i < raw.image->pixels.pixels.size(); ++i) {
      raw.image->pixels.pixels[i] = 20000.0F + 100.0F * static_cast<float>(i % 97);
    }
    raw.calibration.width = 32;
    raw.calibration.height = 24;
    raw.calibration.k = {1000, 0, 15.5, 0, 1000, 11.5, 0, 0, 1};
    return raw;
  }
  static RigidTransform pose() {
    RigidTransform T = RigidTransform::Identity();
    T.translation().z() = 900.0;
    return T;
  }
  Script script_;
};

TEST_F(Pipeline, SaysWhatItWaitsFor) {
  RegistrationPipeline pipeline = make();
  EXPECT_EQ(pipeline.state(), TrackingState::kWaitingForCt);
  FrameOutcome outcome = pipeline.process(1.0, {view()});
  EXPECT_FALSE(outcome.result.accepted);
  EXPECT_NE(outcome.result.reason.find("no CT"), std::string::npos);

  pipeline.setCt(whiteCube(16));
  EXPECT_EQ(pipeline.state(), TrackingState::kWaitingForPose);
  outcome = pipeline.process(1.0, {view()});
  EXPECT_FALSE(outcome.registered);
  EXPECT_NE(outcome.result.reason.find("pose"), std::string::npos);

  pipeline.setPose(pose());
  outcome = pipeline.process(1.1, {view()});
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
  pipeline.setPose(pose());
  std::vector<RawView> bad(6, view());
  bad[0].calibration.k[0] = 0.0;
  bad[1].calibration.width = 0;
  bad[2].calibration.width = 64;
  bad[3].image->pixels = FloatImage(32, 24, 100.0F);
  bad[4].image->pixels.at(3, 3) = std::numeric_limits<float>::quiet_NaN();
  bad[4].image->pixels.at(9, 9) = std::numeric_limits<float>::infinity();
  bad[5].image.reset();
  bad[5].problem = "image encoding 'rgb8' is not one of mono8";
  double stamp = 1.0;
  for (const RawView& raw : bad) {
    const FrameOutcome outcome = pipeline.process(stamp += 0.1, {raw});
    EXPECT_FALSE(outcome.result.accepted) << "case " << &raw - bad.data();
    EXPECT_FALSE(outcome.result.reason.empty());
    EXPECT_FALSE(outcome.registered);
  }
  EXPECT_TRUE(pipeline.process(stamp + 0.1, {view()}).result.accepted);
}

TEST_F(Pipeline, ADeviceThatFailsOnceIsRebuilt) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(pose());
  script_.failures_to_register = 1;
  const FrameOutcome failed = pipeline.process(1.0, {view()});
  EXPECT_FALSE(failed.result.accepted);
  EXPECT_NE(failed.result.reason.find("device lost"), std::string::npos);
  EXPECT_EQ(script_.made, 2);
  EXPECT_NE(failed.state, TrackingState::kFault);
  EXPECT_TRUE(pipeline.process(1.1, {view()}).result.accepted);
}

TEST_F(Pipeline, ADeviceThatFailsAgainIsAFaultUntilReset) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(pose());
  script_.failures_to_register = 2;
  pipeline.process(1.0, {view()});
  FrameOutcome outcome = pipeline.process(1.1, {view()});
  EXPECT_EQ(outcome.state, TrackingState::kFault);
  outcome = pipeline.process(1.2, {view()});
  EXPECT_EQ(outcome.state, TrackingState::kFault);
  EXPECT_NE(outcome.result.reason.find("device lost"), std::string::npos);
  pipeline.reset();
  pipeline.setPose(pose());
  EXPECT_TRUE(pipeline.process(1.3, {view()}).result.accepted);
}

TEST_F(Pipeline, ADeviceThatCannotBeRebuiltIsAFault) {
  RegistrationPipeline pipeline = make();
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(pose());
  script_.failures_to_register = 1;
  script_.failures_to_make = 1;
  EXPECT_EQ(pipeline.process(1.0, {view()}).state, TrackingState::kFault);
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
  pipeline.setPose(pose());
  script_.gives_nan = true;
  const FrameOutcome outcome = pipeline.process(1.0, {view()});
  EXPECT_FALSE(outcome.result.accepted);
  EXPECT_TRUE(outcome.result.T_camera_ct.matrix().allFinite());
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
    pipeline.setPose(pose());
    const FrameOutcome outcome = pipeline.process(1.0, {view("a"), missing});
    EXPECT_FALSE(outcome.result.accepted);
    EXPECT_NE(outcome.result.reason.find("'b'"), std::string::npos);
    EXPECT_EQ(outcome.views_missing, std::vector<std::string>{"b"});
  }
  parameters.sync.allow_missing_view = true;
  RegistrationPipeline pipeline = make(parameters);
  pipeline.setCt(whiteCube(16));
  pipeline.setPose(pose());
  const FrameOutcome outcome = pipeline.process(1.0, {view("a"), missing});
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
  pipeline.setPose(pose());
  RawView missing;
  missing.name = "a";
  RawView second = view("b");
  second.T_view_first.linear() = rotationFromVector(Eigen::Vector3d(0.0, M_PI / 2.0, 0.0));
  second.T_view_first.translation() = Eigen::Vector3d(900.0, 0.0, 900.0);
  const FrameOutcome outcome = pipeline.process(1.0, {missing, second});
  ASSERT_TRUE(outcome.result.accepted) << outcome.result.reason;
  // The registrar sees the second view as the first one ...
  ASSERT_EQ(script_.last_views.size(), 1U);
  EXPECT_TRUE(script_.last_views[0].T_view_first.isApprox(RigidTransform::Identity()));
  EXPECT_TRUE(script_.last_start.isApprox(second.T_view_first * pose()));
  // ... and the answer is in the first view's frame, with the covariance turned: a quarter turn about y swaps x and z.
  EXPECT_TRUE(outcome.result.T_camera_ct.isApprox(pose(), 1e-9));
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
  pipeline.setPose(pose());
  EXPECT_TRUE(pipeline.process(1.0, {view()}).result.accepted);
}

TEST_F(Pipeline, UnreadableMasksAreNamed) {
  NodeParameters parameters;
  parameters.image.mask = "/nowhere/mask.png";
  try {
    make(parameters);
    FAIL();
  } catch (const ParameterError& error) {
    EXPECT_NE(std::string(error.what()).find("image/mask"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("/nowhere/mask.png"), std::string::npos);
  }
}

}  // namespace
}  // namespace xray_registration
