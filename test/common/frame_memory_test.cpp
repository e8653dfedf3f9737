#include "xray_registration/common/frame_memory.h"

#include <gtest/gtest.h>

#include <vector>

namespace xray_registration {
namespace {

// A sanitizer's own allocation does not listen.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#if __GLIBC_PREREQ(2, 33)
auto heap() { return mallinfo2(); }
#else
auto heap() { return mallinfo(); }
#endif

TEST(FrameMemory, AnImageIsNoMappingOfItsOwn) {
  keepMemoryBetweenFrames();
  const auto mappings = heap().hblks;
  const std::vector<float> image(std::size_t{1024} * 1024);
  EXPECT_EQ(heap().hblks, mappings) << image.size();
}

TEST(FrameMemory, WhatIsFreeIsKept) {
  keepMemoryBetweenFrames();
  { const std::vector<float> image(std::size_t{1024} * 1024); }
  const auto in_heap = heap().arena;
  EXPECT_GE(in_heap, decltype(in_heap){4 << 20});
  const std::vector<float> again(std::size_t{1024} * 1024);
  EXPECT_EQ(heap().arena, in_heap) << again.size();
}
#endif

}  // namespace
}  // namespace xray_registration
