#include "xray_registration/drr/resident_volume.h"

#include <algorithm>
#include <cstdint>

namespace xray_registration {

VolumeLimits volumeLimits(const Device& device) {
  VolumeLimits limits;
  limits.buffer_bytes = device.maxAllocationBytes();
  limits.memory_bytes = device.globalMemoryBytes();
  return limits;
}

std::size_t residentVoxelBytes(const VolumeLimits& limits) {
  const double one_buffer = 0.45 * static_cast<double>(limits.buffer_bytes);
  const double all_levels = 0.5 * static_cast<double>(limits.memory_bytes) / 2.5;
  const double indices = 0.9 * static_cast<double>(limits.words) * sizeof(std::uint16_t);
  return static_cast<std::size_t>(std::min({one_buffer, all_levels, indices}));
}

std::size_t residentVoxelBytes(const Device& device) { return residentVoxelBytes(volumeLimits(device)); }

void checkFits(const Eigen::Vector3i& padded, const VolumeLimits& limits, const std::string& device_name) {
  const std::size_t words = static_cast<std::size_t>(padded.x()) * static_cast<std::size_t>(padded.y()) *
                            static_cast<std::size_t>(padded.z());
  const std::string size =
      std::to_string(padded.x()) + "x" + std::to_string(padded.y()) + "x" + std::to_string(padded.z());
  if (words > limits.words) {
    throw DeviceError("the CT has " + std::to_string(words) + " voxels with the air around it (" + size +
                          "), but the kernels number at most " + std::to_string(limits.words) +
                          "; resample the CT to larger voxels",
                      0);
  }
  const std::size_t bytes = words * sizeof(std::uint32_t);
  if (bytes > limits.buffer_bytes) {
    throw DeviceError("the CT needs " + std::to_string(bytes >> 20U) + " MiB in one buffer (" + size + "), but '" +
                          device_name + "' admits " + std::to_string(limits.buffer_bytes >> 20U) +
                          " MiB; resample the CT to larger voxels",
                      0);
  }
}

int ResidentVolume::levelFor(double pixel_mm) const {
  int chosen = 0;
  for (int level = 0; level < static_cast<int>(levels_.size()); ++level) {
    if (levels_[static_cast<std::size_t>(level)].spacing_mm <= 1.25 * pixel_mm) chosen = level;
  }
  return chosen;
}

std::size_t ResidentVolume::bytes() const {
  std::size_t total = 0;
  for (const Level& level : levels_) total += level.bytes;
  return total;
}

}  // namespace xray_registration
