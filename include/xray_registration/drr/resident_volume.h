#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "xray_registration/drr/device.h"
#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// The kernels' view of one level's box of voxels; geometry.cl's Grid.
struct DeviceGrid {
  cl_int size[3];
  cl_int bricks[3];
  cl_float centre[3];
  cl_int unused;
};

/// One level of the CT on the device: its non-air box with two layers of air around it. Each 32-bit word holds a voxel
/// (low half) and its neighbour in z (high half), so one load gives both taps of an interpolation.
struct ResidentLevel {
  cl::Buffer words;
  cl::Buffer occupancy;  ///< A byte per brick of 8³ voxels: whether it holds tissue.
  DeviceGrid grid{};
  Eigen::Affine3d index_from_ct = Eigen::Affine3d::Identity();  ///< CT mm → padded voxel index.
  float scale_per_mm = 0.0F;
  double spacing_mm = 0.0;  ///< Mean over the axes.
  cl_int cut_faces = 0;     ///< Bits: x low, x high, y low, … (AttenuationVolume::face_is_cut).
  std::size_t bytes = 0;
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

/// The CT's pyramid on the device, fine (0) to coarse.
class ResidentVolume {
 public:
  /// Packs and uploads all levels. @throws DeviceError when the device has no room or fails.
  ResidentVolume(Device* device, const AttenuationVolume& volume);
  /// The same within other limits than the device's own.
  ResidentVolume(Device* device, const AttenuationVolume& volume, const VolumeLimits& limits);

  const std::vector<ResidentLevel>& levels() const { return levels_; }
  /// The coarsest level whose voxels are not larger than `pixel_mm` · 1.25, else the finest.
  int levelFor(double pixel_mm) const;
  const Eigen::Vector3d& centreCt() const { return centre_ct_; }
  /// Half the diagonal of the box of tissue, mm.
  double radiusMm() const { return radius_mm_; }
  std::size_t bytes() const;

 private:
  std::vector<ResidentLevel> levels_;
  Eigen::Vector3d centre_ct_ = Eigen::Vector3d::Zero();
  double radius_mm_ = 0.0;
};

}  // namespace xray_registration
