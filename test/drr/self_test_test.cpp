#include "xray_registration/drr/self_test.h"

#include <gtest/gtest.h>

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
  Engine engine(std::make_shared<Device>());
  EXPECT_NO_THROW(selfTest(&engine));
  EXPECT_FALSE(engine.hasVolume());
}

TEST(SelfTestTest, PassesWithSharedRays) {
  // Every way of sharing rays among work-items has kernels of its own.
  for (const int split : {1, 2, 4}) {
    Engine engine(std::make_shared<Device>());
    engine.forceSplit(split);
    EXPECT_NO_THROW(selfTest(&engine)) << "split " << split;
  }
}

TEST(SelfTestTest, LeavesNoTraceInLaterPictures) {
  const AttenuationVolume volume = ball();
  const XrayCamera camera{40, 30, 200.0, 200.0, 19.5, 14.5};
  RigidTransform pose = RigidTransform::Identity();
  pose.translation() = Eigen::Vector3d(-9.5, -9.5, 150.0);
  Engine tested(std::make_shared<Device>());
  tested.setVolume(volume);
  selfTest(&tested);
  tested.setVolume(volume);
  Engine untested(std::make_shared<Device>());
  untested.setVolume(volume);
  const FloatImage drr = tested.render(camera, 0, pose);
  EXPECT_EQ(drr.pixels, untested.render(camera, 0, pose).pixels);
  EXPECT_GT(drr.at(20, 15), 0.25F);  // 15 mm of 0.02 per mm.
}

}  // namespace
}  // namespace xray_registration
