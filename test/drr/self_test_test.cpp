#include "xray_registration/drr/self_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace xray_registration {
namespace {

AttenuationVolume ball() {
  AttenuationVolume volume;
  volume.grid.size = {20, 20, 20};
  volume.scale_per_mm = 1e-6F;
  for (int i = 0; i < 8000; ++i) {
    const Eigen::Vector3d place(i % 20 - 9.5, i / 20 % 20 - 9.5, i / 400 - 9.5);
    volume.values.push_back(place.norm() < 8.0 ? 20000 : 0);
  }
  return volume;
}

TEST(SelfTestTest, PassesAndLeavesNoVolume) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(std::make_shared<Device>());
  EXPECT_NO_THROW(selfTest(engine.get()));
  EXPECT_FALSE(engine->hasVolume());
}

TEST(SelfTestTest, PassesWithSharedRays) {
  // Every way of sharing rays among work-items has kernels of its own.
  for (const int split : {1, 2, 4}) {
    const std::unique_ptr<Engine> engine = makeEngineOpenCl(std::make_shared<Device>());
    engine->forceSplit(split);
    EXPECT_NO_THROW(selfTest(engine.get())) << "split " << split;
  }
}

/// A lopsided picture with values up to 1.
FloatImage picture() {
  FloatImage image(12, 9);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      image.at(u, v) = static_cast<float>(std::exp(-0.05 * ((u - 7) * (u - 7) + 2 * (v - 3) * (v - 3))));
    }
  }
  return image;
}

std::string refusalOf(const FloatImage& rendered) {
  try {
    checkPicture("a lying device", rendered, picture(), 0.08);
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

void expectRefused(const FloatImage& rendered, const std::string& said) {
  const std::string refusal = refusalOf(rendered);
  EXPECT_NE(refusal.find("'a lying device'"), std::string::npos) << said << ": " << refusal;
  EXPECT_NE(refusal.find(said), std::string::npos) << refusal;
}

TEST(CheckPictureTest, PassesWhatIsRight) {
  EXPECT_EQ(refusalOf(picture()), "");
  FloatImage close = picture();
  for (float& value : close.pixels) value += 0.07F;
  EXPECT_EQ(refusalOf(close), "");
}

TEST(CheckPictureTest, RefusesWhatIsMovedMirroredOrMissing) {
  const FloatImage right = picture();
  FloatImage shifted = right;
  FloatImage mirrored = right;
  for (int v = 0; v < right.height; ++v) {
    for (int u = 0; u < right.width; ++u) {
      shifted.at(u, v) = right.at(std::max(u - 1, 0), v);
      mirrored.at(u, v) = right.at(right.width - 1 - u, v);
    }
  }
  expectRefused(shifted, "% off");
  expectRefused(mirrored, "% off");
  expectRefused(FloatImage(right.width, right.height), "100 % off");
  FloatImage one_pixel = right;
  one_pixel.at(2, 8) -= 0.1F;
  expectRefused(one_pixel, "10 % off");
}

TEST(CheckPictureTest, RefusesASinglePixelThatIsNotFinite) {
  for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                            -std::numeric_limits<float>::infinity()}) {
    // Wherever it is: the right pixels before and after it must not cover it up.
    for (const std::size_t place : {std::size_t{0}, std::size_t{50}, picture().pixels.size() - 1}) {
      FloatImage broken = picture();
      broken.pixels[place] = value;
      expectRefused(broken, "not finite");
    }
  }
}

TEST(CheckPictureTest, RefusesAnotherSize) {
  expectRefused(FloatImage(9, 12), "size");
  expectRefused({}, "size");
}

TEST(SelfTestTest, LeavesNoTraceInLaterPictures) {
  const AttenuationVolume volume = ball();
  const XrayCamera camera{40, 30, 200.0, 200.0, 19.5, 14.5};
  RigidTransform pose = RigidTransform::Identity();
  pose.translation() = Eigen::Vector3d(-9.5, -9.5, 150.0);
  const std::unique_ptr<Engine> tested = makeEngineOpenCl(std::make_shared<Device>());
  tested->setVolume(volume);
  selfTest(tested.get());
  tested->setVolume(volume);
  const std::unique_ptr<Engine> untested = makeEngineOpenCl(std::make_shared<Device>());
  untested->setVolume(volume);
  const FloatImage drr = tested->render(camera, 0, pose);
  EXPECT_EQ(drr.pixels, untested->render(camera, 0, pose).pixels);
  EXPECT_GT(drr.at(20, 15), 0.25F);  // 15 mm of 0.02 per mm.
}

}  // namespace
}  // namespace xray_registration
