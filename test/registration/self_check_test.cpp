// Two views of a head by the exact projector, and what the registration makes of them when it is told something wrong.
#include <gtest/gtest.h>

#include <memory>

#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/registration/fast_registrar.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

const XrayCamera kCamera{128, 128, 390.0, 390.0, 63.5, 63.5};

class SelfCheckTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Volume head = headPhantom(2.0);
    const AttenuationVolume body = toAttenuation(head, {});
    registrar_ = std::make_unique<FastRegistrar>(std::make_shared<Device>(), RegistrarOptions{}, Logger{});
    registrar_->setVolume(body);
    truth_.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    truth_.linear() = rotationFromVector({0.1, 0.2, -0.05}) * truth_.linear();
    truth_.translation() = Eigen::Vector3d(3.0, -5.0, 780.0) - truth_.linear() * registrar_->centreCt();
    // The second view is turned by 60 degrees about the middle of the head.
    const Eigen::Vector3d centre = truth_ * registrar_->centreCt();
    T_view_first_ = RigidTransform(Eigen::Translation3d(centre) * Eigen::AngleAxisd(1.05, Eigen::Vector3d::UnitY()) *
                                   Eigen::Translation3d(-centre));
    for (const RigidTransform& T_view_ct : {truth_, RigidTransform(T_view_first_ * truth_)}) {
      XrayFrame frame;
      frame.camera = kCamera;
      frame.attenuation = referenceProjection(body, T_view_ct, kCamera);
      frames_.push_back(frame);
    }
  }
  static void TearDownTestSuite() {
    registrar_.reset();
    frames_.clear();
  }
  void SetUp() override {
    ASSERT_TRUE(registrar_->setOptions({}));
    registrar_->forget();
  }

  static std::vector<ViewInput> views(const RigidTransform& T_view_first = T_view_first_) {
    std::vector<ViewInput> inputs = {ViewInput(frames_[0]),
                                     ViewInput(std::make_shared<const XrayFrame>(frames_[1]), T_view_first)};
    inputs[0].name = "ap";
    inputs[1].name = "oblique";
    return inputs;
  }
  static ViewInput with(const ViewInput& view, const XrayCamera& camera) {
    XrayFrame frame = *view.xray;
    frame.camera = camera;
    ViewInput changed(std::make_shared<const XrayFrame>(std::move(frame)), view.T_view_first);
    changed.name = view.name;
    return changed;
  }
  static RegistrationResult registered(const std::vector<ViewInput>& views) {
    const Twist off = (Twist() << 4.0, -3.0, 5.0, 0.04, -0.05, 0.03).finished();
    return registrar_->registerFrame(views, updatedPose(truth_, off, truth_ * registrar_->centreCt()), false);
  }
  static const SetupSuspicion* find(const RegistrationResult& result, const std::string& words) {
    for (const SetupSuspicion& suspicion : result.suspicions) {
      if (suspicion.in_words == words) return &suspicion;
    }
    return nullptr;
  }
  static void expectRefused(const std::vector<ViewInput>& views, const std::string& words) {
    const RegistrationResult result = registered(views);
    EXPECT_FALSE(result.accepted);
    EXPECT_NE(result.reason.find(words), std::string::npos) << result.reason;
  }

  static std::unique_ptr<FastRegistrar> registrar_;
  static RigidTransform truth_, T_view_first_;
  static std::vector<XrayFrame> frames_;
};

std::unique_ptr<FastRegistrar> SelfCheckTest::registrar_;
RigidTransform SelfCheckTest::truth_ = RigidTransform::Identity();
RigidTransform SelfCheckTest::T_view_first_ = RigidTransform::Identity();
std::vector<XrayFrame> SelfCheckTest::frames_;

TEST_F(SelfCheckTest, WhatIsRightIsAcceptedAndSaidToBe) {
  const RegistrationResult result = registered(views());
  EXPECT_TRUE(result.accepted) << result.reason;
  const SetupSuspicion* focal = find(result, "the focal length");
  ASSERT_NE(focal, nullptr);
  EXPECT_EQ(focal->what, "focal_length");
  EXPECT_EQ(focal->unit, "%");
  EXPECT_LT(std::abs(focal->estimate), 0.2);  // A tenth of what an uncalibrated C-arm is off.
  EXPECT_GT(focal->sigma, 0.0);
  for (const SetupSuspicion& suspicion : result.suspicions) {
    EXPECT_LT(suspicion.effect_mm, 1.0) << suspicion.in_words;  // accept/max_setup_error_mm
  }
}

TEST_F(SelfCheckTest, AFocalLengthThatIsTooLongIsNamed) {
  std::vector<ViewInput> inputs = views();
  for (ViewInput& view : inputs) {
    XrayCamera camera = kCamera;
    camera.fx *= 1.03;
    camera.fy *= 1.03;
    view = with(view, camera);
  }
  expectRefused(inputs, "the focal length looks");
}

TEST_F(SelfCheckTest, APrincipalPointThatIsOffIsNamed) {
  std::vector<ViewInput> inputs = views();
  for (ViewInput& view : inputs) {
    XrayCamera camera = kCamera;
    camera.cx += 8.0;
    view = with(view, camera);
  }
  expectRefused(inputs, "principal point");
}

TEST_F(SelfCheckTest, AViewThatWasElsewhereIsNamed) {
  const Twist off = (Twist() << 1.0, 1.5, 0.0, 0.01, -0.014, 0.005).finished();
  expectRefused(views(updatedPose(T_view_first_, off, T_view_first_ * truth_ * registrar_->centreCt())),
                "the pose of the view 'oblique' looks");
}

TEST_F(SelfCheckTest, AMirroredImageIsNamed) {
  std::vector<ViewInput> inputs = views();
  XrayFrame mirrored = frames_[1];
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      mirrored.attenuation.floats().at(u, v) = frames_[1].attenuation.floats().at(kCamera.width - 1 - u, v);
    }
  }
  inputs[1].xray = std::make_shared<const XrayFrame>(mirrored);
  expectRefused(inputs, "the X-ray of the view 'oblique' looks mirrored left to right");
}

TEST_F(SelfCheckTest, AStartFarOffIsNotTakenForAMirroredImage) {
  // The X-ray is from the side, the start from the front. From the other side the head would look the same in a mirror.
  const Eigen::Vector3d centre = truth_ * registrar_->centreCt();
  const RigidTransform from_the_side =
      RigidTransform(Eigen::Translation3d(centre) * Eigen::AngleAxisd(1.7, Eigen::Vector3d::UnitY()) *
                     Eigen::Translation3d(-centre)) *
      truth_;
  XrayFrame frame;
  frame.camera = kCamera;
  frame.attenuation = referenceProjection(toAttenuation(headPhantom(2.0), {}), from_the_side, kCamera);
  const RegistrationResult result = registered({ViewInput(frame)});
  EXPECT_FALSE(result.accepted);
  EXPECT_NE(result.reason.find("the start looks wrong: turned by"), std::string::npos) << result.reason;
}

TEST_F(SelfCheckTest, TheCheckCanBeSwitchedOff) {
  RegistrarOptions options;
  options.check_every = 0;
  ASSERT_TRUE(registrar_->setOptions(options));
  const RegistrationResult result = registered(views());
  EXPECT_TRUE(result.accepted) << result.reason;
  EXPECT_TRUE(result.suspicions.empty());
}

TEST_F(SelfCheckTest, TrackedFramesAreLookedAtNowAndThen) {
  RegistrarOptions options;
  options.check_every = 2;
  ASSERT_TRUE(registrar_->setOptions(options));
  ASSERT_TRUE(registered(views()).accepted);
  // Somebody knocks the second detector while the head is tracked.
  const Twist off = (Twist() << 1.0, 1.5, 0.0, 0.01, -0.014, 0.005).finished();
  const auto knocked = views(updatedPose(T_view_first_, off, T_view_first_ * truth_ * registrar_->centreCt()));
  int accepted = 0;
  RegistrationResult result;
  for (int i = 0; i < 4; ++i) {
    result = registrar_->registerFrame(knocked, truth_, true);
    accepted += result.accepted ? 1 : 0;
  }
  EXPECT_LE(accepted, 1);  // Until the second one, which is looked at; then every one is.
  EXPECT_NE(result.reason.find("pose of the view"), std::string::npos) << result.reason;
}

TEST_F(SelfCheckTest, ALongTimeOfRightFramesHidesNoKnock) {
  RegistrarOptions options;
  options.check_every = 1;
  options.accept.max_residual_motion_mm = 1000.0;  // Which would see it too, of the frame at hand.
  ASSERT_TRUE(registrar_->setOptions(options));
  ASSERT_TRUE(registered(views()).accepted);
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(registrar_->registerFrame(views(), truth_, true).accepted);
  const Twist off = (Twist() << 1.0, 1.5, 0.0, 0.01, -0.014, 0.005).finished();
  const auto knocked = views(updatedPose(T_view_first_, off, T_view_first_ * truth_ * registrar_->centreCt()));
  const RegistrationResult result = registrar_->registerFrame(knocked, truth_, true);
  EXPECT_FALSE(result.accepted);
  EXPECT_NE(result.reason.find("pose of the view"), std::string::npos) << result.reason;
}

TEST_F(SelfCheckTest, WhatCalibrationLeftOpenWidensTheCovariance) {
  RegistrarOptions options;
  options.setup = {0.0, 0.0, 0.0, 0.0, 0.0};
  ASSERT_TRUE(registrar_->setOptions(options));
  const std::vector<ViewInput> one = {views().front()};
  const Matrix6d noise = registered(one).covariance;
  options.setup.focal_length = 0.02;
  ASSERT_TRUE(registrar_->setOptions(options));
  registrar_->forget();
  const Matrix6d wide = registered(one).covariance;
  // In one view a focal length that is 2 % off is a depth that is 2 % off, and little else.
  EXPECT_NEAR(std::sqrt(wide(2, 2)), 0.02 * 780.0, 2.0);
  EXPECT_LT(wide(0, 0) + wide(1, 1), noise(0, 0) + noise(1, 1) + 0.25);
}

}  // namespace
}  // namespace xray_registration
