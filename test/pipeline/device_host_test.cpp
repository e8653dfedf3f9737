#include "xray_registration/pipeline/device_host.h"

#include <gtest/gtest.h>

#include <new>
#include <stdexcept>

#include "test/pipeline/fake_registrar.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

class Host : public testing::Test {
 protected:
  void SetUp() override {
    body_.attenuation = std::make_shared<const AttenuationVolume>(toAttenuation(whiteCube(8), AttenuationModel{}));
  }

  Script script_;
  DeviceHost host_{fakes(&script_), RegistrarOptions{}, {}};
  RegisteredBody body_{TrackerOptions{}};
};

TEST_F(Host, OpensOnceAndGivesWhatItMadeToTheBody) {
  EXPECT_TRUE(host_.deviceName().empty());
  host_.open();
  host_.open();
  EXPECT_EQ(host_.deviceName(), "fake");
  host_.upload(&body_);
  EXPECT_EQ(script_.made, 1);
  ASSERT_TRUE(body_.registrar);
  EXPECT_TRUE(body_.registrar->hasVolume());
  EXPECT_EQ(body_.centre_ct_mm, Eigen::Vector3d(1.0, 2.0, 3.0));
  host_.upload(&body_);
  EXPECT_EQ(script_.made, 1) << "a second CT needs no other registrar";
  EXPECT_EQ(script_.volumes, 2);
}

TEST_F(Host, UploadsWithoutHavingBeenOpened) {
  host_.upload(&body_);
  EXPECT_TRUE(host_.isReady(&body_));
}

TEST_F(Host, ADeviceThatDoesNotOpenIsAFaultUntilItDoes) {
  script_.failures_to_make = 1;
  EXPECT_THROW(host_.open(), DeviceError);
  EXPECT_NE(host_.fault().find("no device of that name"), std::string::npos);
  EXPECT_FALSE(host_.isReady(&body_));
  host_.upload(&body_);
  EXPECT_TRUE(host_.fault().empty());
  EXPECT_TRUE(host_.isReady(&body_));
}

TEST_F(Host, WhateverAnUploadThrowsLeavesNoRegistrarWithoutACt) {
  const std::vector<std::pair<std::function<void()>, std::string>> failures = {
      {[] { throw DeviceError("no room on the device", -61); }, "no room on the device"},
      {[] { throw std::bad_alloc(); }, "out of memory"},
      {[] { throw std::length_error("vector"); }, "vector"}};
  for (const auto& [fail, words] : failures) {
    script_.on_set_volume = {};
    host_.upload(&body_);
    script_.on_set_volume = fail;
    EXPECT_THROW(host_.upload(&body_), DeviceError) << words;
    EXPECT_FALSE(body_.registrar) << words;
    EXPECT_EQ(script_.alive, 0) << words;
    EXPECT_NE(host_.fault().find(words), std::string::npos) << host_.fault();
    EXPECT_FALSE(host_.isReady(&body_));
    EXPECT_TRUE(host_.deviceName().empty());
  }
  script_.on_set_volume = {};
  host_.upload(&body_);
  EXPECT_TRUE(host_.fault().empty());
  EXPECT_TRUE(host_.isReady(&body_));
}

TEST_F(Host, RebuildsOnceBetweenSuccesses) {
  host_.upload(&body_);
  EXPECT_TRUE(host_.rebuildAfter("device lost", &body_));
  EXPECT_TRUE(host_.isReady(&body_));
  EXPECT_EQ(script_.made, 2);
  EXPECT_EQ(script_.alive, 1);
  host_.noteSuccess();
  EXPECT_TRUE(host_.rebuildAfter("device lost", &body_));
  EXPECT_FALSE(host_.rebuildAfter("device lost again", &body_));
  EXPECT_EQ(host_.fault(), "device lost again");
  EXPECT_EQ(script_.alive, 0);
}

TEST_F(Host, ARebuildThatFailsNamesBothCauses) {
  host_.upload(&body_);
  script_.on_set_volume = [] { throw std::bad_alloc(); };
  EXPECT_FALSE(host_.rebuildAfter("device lost", &body_));
  EXPECT_NE(host_.fault().find("device lost"), std::string::npos);
  EXPECT_NE(host_.fault().find("out of memory"), std::string::npos);
}

TEST_F(Host, AForgottenFaultOpensTheDeviceAnew) {
  host_.upload(&body_);
  host_.rebuildAfter("device lost", &body_);
  host_.rebuildAfter("device lost", &body_);
  host_.forgetFault(&body_);
  EXPECT_TRUE(host_.fault().empty());
  EXPECT_TRUE(host_.isReady(&body_));
  EXPECT_TRUE(host_.rebuildAfter("device lost", &body_)) << "what was before the fault does not count any more";
}

TEST_F(Host, ForgettingNoFaultKeepsTheDevice) {
  host_.upload(&body_);
  host_.forgetFault(&body_);
  EXPECT_EQ(script_.made, 1);
  EXPECT_TRUE(body_.registrar);
}

TEST_F(Host, NewOptionsMakeARegistrarAnewOnlyWhereTheyMust) {
  host_.upload(&body_);
  host_.setOptions({}, &body_);
  EXPECT_EQ(script_.made, 1);
  script_.takes_options = false;
  host_.setOptions({}, &body_);
  EXPECT_EQ(script_.made, 2);
  EXPECT_EQ(script_.alive, 1);
  EXPECT_TRUE(host_.isReady(&body_));
  script_.on_set_volume = [] { throw std::bad_alloc(); };
  EXPECT_THROW(host_.setOptions({}, &body_), DeviceError);
  EXPECT_FALSE(host_.fault().empty());
}

TEST_F(Host, ARegistrarThatWaitsForItsCtHasTheNewOptions) {
  host_.open();
  script_.takes_options = false;
  host_.setOptions({}, &body_);
  host_.upload(&body_);
  EXPECT_EQ(script_.made, 2);
  EXPECT_EQ(script_.alive, 1);
}

}  // namespace
}  // namespace xray_registration
