#include "xray_registration/ros/image_gate.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

using namespace std::chrono_literals;

/// Two views at 10 frames a second.
class Gate {
 public:
  explicit Gate(bool looks_for_held = true) : gate(2, StampParameters{}, false, looks_for_held) {}

  ImageGate::Judgement image(std::size_t view, double stamp_s, std::uint8_t pixel) {
    sensor_msgs::Image message;
    message.header.stamp = ros::Time(stamp_s);
    message.data = {pixel};
    return gate.judge(view, message, ros::Time(1000.0), at += 100ms);
  }

  ImageGate gate;
  ImageGate::Clock::time_point at{1s};
};

TEST(ImageGate, EachViewHasStampsAndPixelsOfItsOwn) {
  Gate gate;
  EXPECT_EQ(gate.image(0, 10.0, 1).stamp.problem, "");
  EXPECT_EQ(gate.image(1, 9.99, 1).stamp.problem, "");
  EXPECT_NE(gate.image(0, 9.99, 2).stamp.problem, "");
  const ImageGate::Judgement held = gate.image(0, 10.1, 1);
  EXPECT_EQ(held.stamp.problem, "");
  EXPECT_NEAR(held.held_for_s.value_or(0.0), 0.3, 1e-9);
  EXPECT_FALSE(gate.image(1, 10.09, 2).held_for_s);
}

TEST(ImageGate, WhatIsRefusedIsNotWhatOthersAreComparedWith) {
  Gate gate;
  gate.image(0, 10.0, 1);
  EXPECT_NE(gate.image(0, 5.0, 2).stamp.problem, "");
  EXPECT_TRUE(gate.image(0, 10.1, 1).held_for_s);
}

TEST(ImageGate, ForgetsOnDemand) {
  Gate gate;
  gate.image(0, 10.0, 1);
  gate.image(1, 10.0, 1);
  gate.gate.forget();
  for (const std::size_t view : {0U, 1U}) {
    const ImageGate::Judgement first = gate.image(view, 5.0, 1);
    EXPECT_EQ(first.stamp.problem, "");
    EXPECT_FALSE(first.held_for_s);
  }
}

TEST(ImageGate, ComparesNoPixelsWhenItIsNotTo) {
  Gate gate(false);
  gate.image(0, 10.0, 1);
  EXPECT_FALSE(gate.image(0, 10.1, 1).held_for_s);
}

}  // namespace
}  // namespace xray_registration
