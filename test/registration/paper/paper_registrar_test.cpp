#include "xray_registration/registration/paper/paper_registrar.h"

#include <gtest/gtest.h>

#include <cmath>

#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

/// A head seen from the side by the exact projector; one upload for all tests.
class PaperRegistrarTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    volume_ = std::make_unique<AttenuationVolume>(toAttenuation(headPhantom(3.0), {}));
    registrar_ = makeRegistrar(RegistrarOptions{});
    registrar_->setVolume(*volume_);
    truth_.linear() << 0, 1, 0, 0, 0, -1, -1, 0, 0;
    truth_.translation() = Eigen::Vector3d(3.0, -5.0, 780.0) - truth_.linear() * registrar_->centreCt();
    view_ = std::make_unique<XrayFrame>();
    view_->camera = {128, 128, 520.0, 520.0, 63.5, 63.5};
    view_->attenuation = referenceProjection(*volume_, truth_, view_->camera);
    // Gain, offset, and a veil that no DRR has.
    for (int v = 0; v < 128; ++v) {
      for (int u = 0; u < 128; ++u) {
        float& pixel = view_->attenuation.floats().at(u, v);
        pixel = 0.8F * pixel + 0.3F + 0.003F * static_cast<float>(u + v);
      }
    }
  }
  static void TearDownTestSuite() {
    registrar_.reset();
    volume_.reset();
    view_.reset();
  }

  static std::unique_ptr<PaperRegistrar> makeRegistrar(RegistrarOptions options) {
    options.method = Method::kPaper;
    options.paper_image_size = 64;
    return std::make_unique<PaperRegistrar>(std::make_shared<Device>(), options, Logger{});
  }

  static RigidTransform disturbed() {
    Twist twist;
    twist << 2.0, -1.5, 2.0, 0.02, -0.02, 0.02;
    return updatedPose(truth_, twist, truth_ * registrar_->centreCt());
  }

  static std::unique_ptr<AttenuationVolume> volume_;
  static std::unique_ptr<PaperRegistrar> registrar_;
  static std::unique_ptr<XrayFrame> view_;
  static RigidTransform truth_;
};

std::unique_ptr<AttenuationVolume> PaperRegistrarTest::volume_;
std::unique_ptr<PaperRegistrar> PaperRegistrarTest::registrar_;
std::unique_ptr<XrayFrame> PaperRegistrarTest::view_;
RigidTransform PaperRegistrarTest::truth_ = RigidTransform::Identity();

TEST_F(PaperRegistrarTest, FindsAnXrayWithGainOffsetAndVeil) {
  const RegistrationResult result = registrar_->registerFrame({*view_}, disturbed(), false);
  EXPECT_TRUE(result.accepted) << result.reason;
  EXPECT_TRUE(result.reason.empty());
  const PoseError error = poseError(result.T_camera_ct, truth_, targetGrid(registrar_->centreCt(), 100.0));
  // Pixels of 3 mm at the head, voxels of 3 mm: a tenth of a pixel, and ten times that in depth.
  EXPECT_LT(error.inplane_mm, 0.3);
  EXPECT_LT(error.mtre_mm, 3.0);
  EXPECT_GT(result.similarity, 0.9);
  EXPECT_EQ(result.inlier_fraction, 1.0);
  EXPECT_GT(result.condition_number, 1.0);
  EXPECT_TRUE(result.covariance.allFinite());
  EXPECT_TRUE(result.covariance.isApprox(result.covariance.transpose(), 1e-9));
  // A single view hardly sees depth.
  EXPECT_GT(result.covariance(2, 2), 4.0 * result.covariance(0, 0));
}

TEST_F(PaperRegistrarTest, RenderingBetweenFramesChangesNothing) {
  const RegistrationResult before = registrar_->registerFrame({*view_}, disturbed(), false);
  const XrayCamera camera{50, 40, 200.0, 200.0, 24.5, 19.5};
  const FloatImage drr = registrar_->renderDrr(camera, truth_);
  EXPECT_EQ(drr.width, 50);
  EXPECT_GT(drr.at(25, 20), 0.5F);
  const RegistrationResult after = registrar_->registerFrame({*view_}, disturbed(), false);
  EXPECT_EQ(before.T_camera_ct.matrix(), after.T_camera_ct.matrix());  // To the bit.
}

TEST_F(PaperRegistrarTest, MaskedPixelsHaveNoSay) {
  XrayFrame view = *view_;
  view.mask = MaskImage(128, 128, 255);
  for (int v = 20; v < 60; ++v) {
    for (int u = 70; u < 90; ++u) {
      view.attenuation.floats().at(u, v) = 9.0F;  // Metal.
      view.mask.at(u, v) = 0;
    }
  }
  const RegistrationResult result = registrar_->registerFrame({view}, disturbed(), false);
  EXPECT_TRUE(result.accepted) << result.reason;
  const PoseError error = poseError(result.T_camera_ct, truth_, targetGrid(registrar_->centreCt(), 100.0));
  EXPECT_LT(error.inplane_mm, 0.3);

  view.mask = MaskImage(128, 128, 0);
  const RegistrationResult nothing = registrar_->registerFrame({view}, disturbed(), false);
  EXPECT_FALSE(nothing.accepted);
  EXPECT_FALSE(nothing.reason.empty());
}

TEST_F(PaperRegistrarTest, AnotherPictureIsRefused) {
  XrayFrame view = *view_;
  std::reverse(view.attenuation.floats().pixels.begin(), view.attenuation.floats().pixels.end());
  const RegistrationResult result = registrar_->registerFrame({view}, disturbed(), false);
  EXPECT_FALSE(result.accepted);
  EXPECT_FALSE(result.reason.empty());
  EXPECT_TRUE(result.T_camera_ct.matrix().allFinite());
}

TEST_F(PaperRegistrarTest, WhatCannotBeRegisteredIsRefusedWithAReason) {
  const auto refused = [](const RegistrationResult& result, const std::string& word) {
    EXPECT_FALSE(result.accepted);
    EXPECT_NE(result.reason.find(word), std::string::npos) << result.reason;
  };
  refused(registrar_->registerFrame({*view_, *view_}, truth_, false), "one view");
  refused(registrar_->registerFrame({}, truth_, false), "one view");
  XrayFrame view = *view_;
  view.attenuation.floats().pixels[5] = std::nanf("");
  refused(registrar_->registerFrame({view}, truth_, false), "finite");
  view = *view_;
  view.camera.width = 127;
  refused(registrar_->registerFrame({view}, truth_, false), "size");
  view = *view_;
  view.camera.fx = 0.0;
  refused(registrar_->registerFrame({view}, truth_, false), "focal");
  RigidTransform outside = truth_;
  outside.translation().x() += 3000.0;
  refused(registrar_->registerFrame({*view_}, outside, false), "outside");
  const auto without_ct = makeRegistrar({});
  refused(without_ct->registerFrame({*view_}, truth_, false), "no CT");
  EXPECT_FALSE(without_ct->hasVolume());
}

TEST_F(PaperRegistrarTest, AJumpWhileTrackingIsRefused) {
  RegistrarOptions options;
  options.accept.max_jump_mm = 0.5;
  options.method = Method::kPaper;
  options.paper_image_size = 64;
  ASSERT_TRUE(registrar_->setOptions(options));
  EXPECT_FALSE(registrar_->registerFrame({*view_}, disturbed(), true).accepted);
  EXPECT_TRUE(registrar_->registerFrame({*view_}, disturbed(), false).accepted);
  options.accept = {};
  ASSERT_TRUE(registrar_->setOptions(options));
  options.method = Method::kFast;
  EXPECT_FALSE(registrar_->setOptions(options));
}

}  // namespace
}  // namespace xray_registration
