// X-rays of a head by the exact projector, registered with the CT of the same head and with a bent one.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "evaluation/wrong_ct.h"
#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/registration/fast_registrar.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

const XrayCamera kCamera{128, 128, 390.0, 390.0, 63.5, 63.5};

class OtherPatientTest : public testing::Test {
 protected:
  OtherPatientTest() : head_(headPhantom(2.0)) {
    truth_.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    truth_.linear() = rotationFromVector({0.1, 0.7, -0.05}) * truth_.linear();
    truth_.translation() = Eigen::Vector3d(3.0, -5.0, 780.0) - truth_.linear() * head_.grid.centreCt();
    xray_.camera = kCamera;
    xray_.attenuation = referenceProjection(toAttenuation(head_, {}), truth_, kCamera);
  }

  RegistrationResult registered(const Volume& ct) const {
    FastRegistrar registrar(std::make_shared<Device>(), RegistrarOptions{}, Logger{});
    registrar.setVolume(toAttenuation(ct, {}));
    const Twist off = (Twist() << 4.0, -3.0, 5.0, 0.04, -0.05, 0.03).finished();
    return registrar.registerFrame({ViewInput(xray_)}, updatedPose(truth_, off, truth_ * registrar.centreCt()), false);
  }

  /// What no pose moves away; certain when a suspicion.
  static SetupSuspicion leftToMove(const RegistrationResult& result) {
    const auto found = std::find_if(
        result.suspicions.begin(), result.suspicions.end(),
        [](const SetupSuspicion& suspicion) { return suspicion.in_words.find("no pose") != std::string::npos; });
    return found == result.suspicions.end() ? SetupSuspicion{} : *found;
  }

  Volume head_;
  RigidTransform truth_ = RigidTransform::Identity();
  XrayFrame xray_;
};

TEST_F(OtherPatientTest, HisOwnCtLeavesNothingToMove) {
  const RegistrationResult result = registered(head_);
  EXPECT_TRUE(result.accepted) << result.reason;
  const SetupSuspicion left = leftToMove(result);
  EXPECT_EQ(left.what, "other_patient");
  EXPECT_EQ(left.unit, "mm");
  EXPECT_LT(left.estimate, 0.1);  // A third of accept/max_residual_motion_mm.
}

TEST_F(OtherPatientTest, ABentCtIsRefusedByName) {
  const RegistrationResult result = registered(bent(head_, 5.0, 1));
  EXPECT_FALSE(result.accepted);
  EXPECT_NE(result.reason.find("another patient"), std::string::npos) << result.reason;
  const SetupSuspicion left = leftToMove(result);
  EXPECT_TRUE(left.certain);
  EXPECT_GT(left.estimate, 0.3);
  EXPECT_LT(left.estimate, 5.0);  // Nothing was moved further.
}

}  // namespace
}  // namespace xray_registration
