#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "xray_registration/drr/device.h"

namespace xray_registration {

/// The CT's pyramid on a device, fine (0) to coarse, as those who do not know the device see it.
class ResidentVolume {
 public:
  struct Level {
    double spacing_mm = 0.0;  ///< Mean over the axes.
    std::size_t bytes = 0;    ///< On the device.
  };

  ResidentVolume() = default;
  ResidentVolume(std::vector<Level> levels, const Eigen::Vector3d& centre_ct_mm, double radius_mm,
                 std::vector<Eigen::Vector3d> corners_ct_mm = {})
      : levels_(std::move(levels)),
        centre_ct_(centre_ct_mm),
        radius_mm_(radius_mm),
        corners_ct_mm_(std::move(corners_ct_mm)) {}

  const std::vector<Level>& levels() const { return levels_; }
  /// The coarsest level whose voxels are not larger than `pixel_mm` · 1.25, else the finest.
  int levelFor(double pixel_mm) const;
  const Eigen::Vector3d& centreCt() const { return centre_ct_; }
  /// Half the diagonal of the box of tissue, mm.
  double radiusMm() const { return radius_mm_; }
  /// The eight corners of the box of tissue.
  const std::vector<Eigen::Vector3d>& cornersCt() const { return corners_ct_mm_; }
  std::size_t bytes() const;

 private:
  std::vector<Level> levels_;
  Eigen::Vector3d centre_ct_ = Eigen::Vector3d::Zero();
  double radius_mm_ = 0.0;
  std::vector<Eigen::Vector3d> corners_ct_mm_;
};

/// What bounds the CT on a device.
struct VolumeLimits {
  std::size_t buffer_bytes = 0;     ///< Of one buffer: the finest level is one.
  std::size_t memory_bytes = 0;     ///< Of the device.
  std::size_t words = 0x7fffffffU;  ///< Of one level, padding included: the kernels index them by 32-bit integers.
};
VolumeLimits volumeLimits(const Device& device);

/// The largest CT, in bytes of 16-bit voxels, that a device takes with its pyramid: packed words are twice as large, a
/// tenth is for the padding; X-rays and other programs keep half of the memory.
std::size_t residentVoxelBytes(const VolumeLimits& limits);
std::size_t residentVoxelBytes(const Device& device);

/// @throws DeviceError when a level of `padded` words is more than the limits admit; it names both sizes.
void checkFits(const Eigen::Vector3i& padded, const VolumeLimits& limits, const std::string& device_name);

}  // namespace xray_registration
