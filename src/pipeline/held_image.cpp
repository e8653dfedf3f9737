#include "xray_registration/pipeline/held_image.h"

#include <cstring>

namespace xray_registration {
namespace {

// Four sums side by side: a multiplication waits for the one before it. Each step is a bijection of its sum, so one
// word that differs always shows.
constexpr std::size_t kLanes = 4;
constexpr std::uint64_t kFactor = 0x9E3779B97F4A7C15ULL;  // 2^64 over the golden ratio, odd

std::uint64_t mixed(std::uint64_t sum, std::uint64_t word) {
  sum = (sum ^ word) * kFactor;
  return sum ^ (sum >> 29U);
}

}  // namespace

std::uint64_t quickHash(const void* bytes, std::size_t count) {
  const auto* next = static_cast<const unsigned char*>(bytes);
  std::uint64_t sums[kLanes] = {1, 2, 3, 4};
  std::size_t left = count;
  for (; left >= sizeof sums; left -= sizeof sums, next += sizeof sums) {
    std::uint64_t words[kLanes];
    std::memcpy(words, next, sizeof words);
    for (std::size_t lane = 0; lane < kLanes; ++lane) sums[lane] = mixed(sums[lane], words[lane]);
  }
  std::uint64_t result = mixed(kFactor, count);
  for (const std::uint64_t sum : sums) result = mixed(result, sum);
  for (; left > 0; --left, ++next) result = mixed(result, *next);
  return result;
}

std::optional<double> HeldImage::heldFor(std::uint64_t hash, Clock::time_point now) {
  if (last_ && last_->hash == hash) return std::chrono::duration<double>(now - last_->since).count();
  last_ = Shown{hash, now};
  return std::nullopt;
}

}  // namespace xray_registration
