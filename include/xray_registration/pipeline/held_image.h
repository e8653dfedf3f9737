#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace xray_registration {

/// A number that differs when one of the bytes does, but for one chance in 2^64. As fast as memory is read.
std::uint64_t quickHash(const void* bytes, std::size_t count);

/// Notices that a device shows its last image on (last image hold): the same pixels under new stamps are no new
/// observation. Noise makes every real image another. Not thread-safe.
class HeldImage {
 public:
  using Clock = std::chrono::steady_clock;

  /// To be told of every image of a camera. For how long it has been held already; nothing when it is a new one.
  std::optional<double> heldFor(std::uint64_t hash, Clock::time_point now);

  void forget() { last_.reset(); }

 private:
  struct Shown {
    std::uint64_t hash = 0;
    Clock::time_point since;
  };
  std::optional<Shown> last_;
};

}  // namespace xray_registration
