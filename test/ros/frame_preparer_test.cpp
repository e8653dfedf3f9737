#include "xray_registration/ros/frame_preparer.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/make_shared.hpp>
#include <chrono>
#include <future>
#include <stdexcept>
#include <string>

namespace xray_registration {
namespace {

FrameMessages frameAt(double stamp_s) {
  auto image = boost::make_shared<sensor_msgs::Image>();
  image->header.stamp = ros::Time(stamp_s);
  FrameMessages frame;
  frame.header = image->header;
  frame.views.resize(1);
  frame.views[0].image = image;
  frame.views[0].info = boost::make_shared<sensor_msgs::CameraInfo>();
  return frame;
}

/// Says which frame it was made of.
PreparedFrame namedAfter(const FrameMessages& frame) {
  PreparedFrame prepared;
  prepared.problem = std::to_string(frame.header.stamp.sec);
  return prepared;
}

/// Counts, and waits at a gate in the second thread.
class Preparation {
 public:
  PreparedFrame operator()(const FrameMessages& frame) {
    ++count;
    if (std::this_thread::get_id() != caller) {
      started.set_value();
      gate.get_future().wait();
    }
    return namedAfter(frame);
  }
  std::atomic<int> count{0};
  std::promise<void> started;
  std::promise<void> gate;
  const std::thread::id caller = std::this_thread::get_id();
};

TEST(FramePreparerTest, PreparesNowWhatNobodyAskedFor) {
  Preparation preparation;
  FramePreparer preparer(std::ref(preparation));
  EXPECT_EQ(preparer.take(frameAt(7)).problem, "7");
  EXPECT_EQ(preparation.count, 1);
}

TEST(FramePreparerTest, GivesWhatWasPreparedAhead) {
  Preparation preparation;
  preparation.gate.set_value();
  FramePreparer preparer(std::ref(preparation));
  const FrameMessages frame = frameAt(3);
  preparer.offer(frame);
  preparation.started.get_future().wait();
  EXPECT_EQ(preparer.take(frame).problem, "3");
  EXPECT_EQ(preparation.count, 1);  // Not a second time.
}

TEST(FramePreparerTest, WaitsForAPreparationUnderWay) {
  Preparation preparation;
  FramePreparer preparer(std::ref(preparation));
  const FrameMessages frame = frameAt(4);
  preparer.offer(frame);
  preparation.started.get_future().wait();
  std::future<PreparedFrame> taken = std::async(std::launch::async, [&] { return preparer.take(frame); });
  // It cannot be ready before the gate opens; the time only gives a wrong one the chance to be.
  EXPECT_EQ(taken.wait_for(std::chrono::milliseconds(20)), std::future_status::timeout);
  preparation.gate.set_value();
  EXPECT_EQ(taken.get().problem, "4");
  EXPECT_EQ(preparation.count, 1);
}

TEST(FramePreparerTest, AnotherFrameDoesNotWaitForIt) {
  Preparation preparation;
  FramePreparer preparer(std::ref(preparation));
  preparer.offer(frameAt(4));
  preparation.started.get_future().wait();
  EXPECT_EQ(preparer.take(frameAt(5)).problem, "5");
  preparation.gate.set_value();
}

TEST(FramePreparerTest, ANewerFrameReplacesOneThatWaits) {
  Preparation preparation;
  FramePreparer preparer(std::ref(preparation));
  preparer.offer(frameAt(1));
  preparation.started.get_future().wait();
  const FrameMessages replaced = frameAt(2);
  preparer.offer(replaced);
  const FrameMessages newest = frameAt(3);
  preparer.offer(newest);
  EXPECT_EQ(preparer.take(newest).problem, "3");    // Still waiting: taken over.
  EXPECT_EQ(preparer.take(replaced).problem, "2");  // Nobody prepared it.
  EXPECT_EQ(preparation.count, 3);
  preparation.gate.set_value();
}

TEST(FramePreparerTest, WhatFailsAheadFailsAgainWhereItIsHeard) {
  FramePreparer preparer([](const FrameMessages&) -> PreparedFrame { throw std::runtime_error("no memory"); });
  const FrameMessages frame = frameAt(1);
  preparer.offer(frame);
  EXPECT_THROW(preparer.take(frame), std::runtime_error);
}

TEST(FramePreparerTest, WorksWithoutItsThread) {
  Preparation preparation;
  FramePreparer preparer(std::ref(preparation));
  preparer.stop();
  const FrameMessages frame = frameAt(8);
  preparer.offer(frame);
  EXPECT_EQ(preparer.take(frame).problem, "8");
  EXPECT_EQ(preparation.count, 1);
}

}  // namespace
}  // namespace xray_registration
