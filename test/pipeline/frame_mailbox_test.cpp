#include "xray_registration/pipeline/frame_mailbox.h"

#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <thread>
#include <vector>

namespace xray_registration {
namespace {

using Mailbox = FrameMailbox<int>;

TEST(FrameMailbox, KeepsTheNewestAndGivesBackWhatItReplaces) {
  Mailbox mailbox;
  EXPECT_FALSE(mailbox.put(1));
  EXPECT_EQ(mailbox.put(2), 1);
  EXPECT_EQ(mailbox.put(3), 2);
  Mailbox::Job job;
  std::optional<int> frame;
  ASSERT_TRUE(mailbox.take(&job, &frame));
  EXPECT_EQ(frame, 3);
  EXPECT_FALSE(mailbox.clear());
}

TEST(FrameMailbox, JobsComeFirstAndInOrder) {
  Mailbox mailbox;
  std::vector<int> order;
  mailbox.put(9);
  mailbox.post([&] { order.push_back(1); });
  mailbox.post([&] { order.push_back(2); });
  Mailbox::Job job;
  std::optional<int> frame;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(mailbox.take(&job, &frame));
    if (job) job();
    if (frame) order.push_back(*frame);
  }
  EXPECT_EQ(order, (std::vector<int>{1, 2, 9}));
}

TEST(FrameMailbox, ClosingEndsTheWaitAndBreaksPromises) {
  Mailbox mailbox;
  auto promise = std::make_shared<std::promise<int>>();
  std::future<int> answer = promise->get_future();
  mailbox.post([promise] { promise->set_value(1); });
  promise.reset();
  mailbox.close();
  EXPECT_THROW(answer.get(), std::future_error);
  Mailbox::Job job;
  std::optional<int> frame;
  EXPECT_FALSE(mailbox.take(&job, &frame));
  EXPECT_FALSE(mailbox.post([] {}));
  EXPECT_EQ(mailbox.put(4), 4);
}

TEST(FrameMailbox, ClosingWakesAWaitingWorker) {
  Mailbox mailbox;
  std::future<bool> taken = std::async(std::launch::async, [&] {
    Mailbox::Job job;
    std::optional<int> frame;
    return mailbox.take(&job, &frame);
  });
  mailbox.close();
  EXPECT_FALSE(taken.get());
}

TEST(FrameMailbox, EveryFrameIsTakenOrGivenBack) {
  Mailbox mailbox;
  constexpr int kFrames = 20000;
  int taken = 0;
  std::thread worker([&] {
    Mailbox::Job job;
    std::optional<int> frame;
    while (mailbox.take(&job, &frame)) {
      if (frame) ++taken;
      if (frame == kFrames - 1) return;
    }
  });
  int replaced = 0;
  for (int i = 0; i < kFrames; ++i) {
    if (mailbox.put(i)) ++replaced;
  }
  worker.join();
  EXPECT_EQ(taken + replaced, kFrames);
}

TEST(FrameMailbox, ADeadlineEndsAWait) {
  FrameMailbox<int> mailbox;
  FrameMailbox<int>::Job job;
  std::optional<int> frame;
  const auto past = std::chrono::steady_clock::now() - std::chrono::seconds(1);
  EXPECT_TRUE(mailbox.take(&job, &frame, past));
  EXPECT_FALSE(job);
  EXPECT_FALSE(frame);
  mailbox.put(7);
  EXPECT_TRUE(mailbox.take(&job, &frame, past));  // What is there comes first.
  EXPECT_EQ(frame, 7);
}

}  // namespace
}  // namespace xray_registration
