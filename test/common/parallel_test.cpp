#include "xray_registration/common/parallel.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <fstream>
#include <new>
#include <vector>

namespace xray_registration {
namespace {

std::vector<int> eachOnce(int count) {
  std::vector<int> touched(static_cast<std::size_t>(count), 0);
  parallelFor(count, [&touched](int begin, int end) {
    for (int i = begin; i < end; ++i) ++touched[static_cast<std::size_t>(i)];
  });
  return touched;
}

bool aThreadStarts() {
  try {
    std::thread([] {}).join();
    return true;
  } catch (const std::system_error&) {
    return false;
  }
}

// First of all: the stacks of threads that have ended are kept and used again.
TEST(ParallelFor, WithoutMemoryForAThreadTheCallerDoesTheWork) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "needs a limit of the address space, of which a sanitizer takes all there is";
#endif
  std::vector<int> expected(1000, 1);
  rlimit before{};
  getrlimit(RLIMIT_AS, &before);
  long pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  // A thread's stack takes 8 MiB; half a MiB is enough for what the caller allocates.
  rlimit tight = before;
  tight.rlim_cur = static_cast<rlim_t>(pages) * 4096U + (rlim_t{1} << 19U);
  setrlimit(RLIMIT_AS, &tight);
  const std::vector<int> touched = eachOnce(1000);
  const bool could_have = aThreadStarts();
  setrlimit(RLIMIT_AS, &before);
  EXPECT_EQ(touched, expected);
  EXPECT_FALSE(could_have) << "the limit is too wide to show anything";
}

TEST(ParallelFor, WhatAPartThrowsReachesTheCaller) {
  for (const int failing : {0, 999}) {  // In the caller's own part, and in the last thread's.
    std::vector<int> touched(1000, 0);
    EXPECT_THROW(parallelFor(1000,
                             [&touched, failing](int begin, int end) {
                               for (int i = begin; i < end; ++i) ++touched[static_cast<std::size_t>(i)];
                               if (begin <= failing && failing < end) throw std::bad_alloc();
                             }),
                 std::bad_alloc);
    EXPECT_EQ(touched, std::vector<int>(1000, 1)) << "the other parts are done";
  }
}

TEST(ParallelFor, WorksOnEveryPartOnce) {
  for (const int count : {0, 1, 2, 7, 1000}) {
    EXPECT_EQ(eachOnce(count), std::vector<int>(static_cast<std::size_t>(count), 1));
  }
}

}  // namespace
}  // namespace xray_registration
