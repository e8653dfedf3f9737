#include "xray_registration/pipeline/held_image.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace xray_registration {
namespace {

using namespace std::chrono_literals;

std::uint64_t hashOf(const std::vector<unsigned char>& bytes) { return quickHash(bytes.data(), bytes.size()); }

TEST(QuickHash, EveryBitCounts) {
  // Lengths around the 32 bytes that are taken at once.
  for (const std::size_t length : {1U, 31U, 32U, 33U, 100U}) {
    std::vector<unsigned char> bytes(length, 7);
    std::set<std::uint64_t> hashes = {hashOf(bytes)};
    for (std::size_t bit = 0; bit < 8 * length; ++bit) {
      bytes[bit / 8] ^= static_cast<unsigned char>(1U << (bit % 8));
      hashes.insert(hashOf(bytes));
      bytes[bit / 8] ^= static_cast<unsigned char>(1U << (bit % 8));
    }
    EXPECT_EQ(hashes.size(), 8 * length + 1);
  }
}

TEST(QuickHash, PlaceAndLengthCount) {
  std::vector<unsigned char> one(64, 0);
  one[0] = 1;
  std::vector<unsigned char> other(64, 0);
  other[32] = 1;
  EXPECT_NE(hashOf(one), hashOf(other));
  EXPECT_NE(hashOf(std::vector<unsigned char>(64, 0)), hashOf(std::vector<unsigned char>(96, 0)));
  EXPECT_EQ(hashOf(one), hashOf(std::vector<unsigned char>(one)));
}

TEST(HeldImage, SaysForHowLong) {
  HeldImage held;
  HeldImage::Clock::time_point now{1s};
  EXPECT_FALSE(held.heldFor(1, now));
  EXPECT_FALSE(held.heldFor(2, now += 100ms));
  EXPECT_NEAR(held.heldFor(2, now += 100ms).value(), 0.1, 1e-9);
  EXPECT_NEAR(held.heldFor(2, now += 2s).value(), 2.1, 1e-9);
  EXPECT_FALSE(held.heldFor(1, now += 100ms));
  held.forget();
  EXPECT_FALSE(held.heldFor(1, now += 100ms));
}

}  // namespace
}  // namespace xray_registration
