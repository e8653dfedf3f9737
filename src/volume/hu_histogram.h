#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace xray_registration {

/// How often each value occurs, in at most some four million voxels that are evenly taken.
class HuHistogram {
 public:
  explicit HuHistogram(const std::vector<std::int16_t>& hu);

  /// Forgets all voxels of this very value.
  void leaveOut(std::int16_t value);

  std::size_t count() const { return total_; }

  /// Share of the voxels from `low` to `high`, both included; 0 when there are none at all.
  double share(int low, int high) const;

  /// The value that this share of the voxels lies below.
  int quantile(double share) const;

  /// The most frequent value from `low` to `high`; empty when no voxel has one.
  std::optional<int> peak(int low, int high) const;

 private:
  std::vector<std::uint32_t> counts_;
  std::size_t total_ = 0;
};

}  // namespace xray_registration
