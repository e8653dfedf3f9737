#pragma once

#include <cstddef>
#include <vector>

#include "xray_registration/drr/engine.h"
#include "xray_registration/drr/opencl/opencl_device.h"
#include "xray_registration/drr/resident_volume.h"
#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// The kernels' view of one level's box of voxels; geometry.cl's Grid.
struct DeviceGrid {
  cl_int size[3];
  cl_int bricks[3];
  cl_float centre[3];
  cl_int has_voxels;  ///< 1: they stand behind the words.
};

/// Whether a device may have a level's voxels behind its words. A CPU loads 32 bits from wherever it likes; a GPU wants
/// its loads aligned.
bool hasVoxels16(const Device& device);

/// One level of the CT on the device: its non-air box with layers of air around it. Each 32-bit word holds a voxel (low
/// half) and its neighbour in z (high half), so one load gives both taps of an interpolation. On a CPU, the voxels of a
/// level that is not large stand behind the words once more, 16 bits each, so that the same is true of neighbours in x,
/// which rays along z want.
struct OpenClLevel {
  cl::Buffer words;
  cl::Buffer occupancy;  ///< A byte per brick: whether it holds tissue.
  DeviceGrid grid{};
  Eigen::Affine3d index_from_ct = Eigen::Affine3d::Identity();  ///< CT mm → padded voxel index.
  float scale_per_mm = 0.0F;
  double spacing_mm = 0.0;  ///< Mean over the axes.
  cl_int cut_faces = 0;     ///< Bits: x low, x high, y low, … (AttenuationVolume::face_is_cut).
  std::size_t bytes = 0;
};

/// The CT's pyramid in OpenCL buffers, fine (0) to coarse.
class OpenClVolume {
 public:
  /// Packs and uploads all levels. @throws DeviceError when the device has no room or fails.
  OpenClVolume(const Device& device, const AttenuationVolume& volume);
  /// The same within other limits than the device's own.
  OpenClVolume(const Device& device, const AttenuationVolume& volume, const VolumeLimits& limits);

  const std::vector<OpenClLevel>& levels() const { return levels_; }
  const ResidentVolume& description() const { return description_; }

 private:
  std::vector<OpenClLevel> levels_;
  ResidentVolume description_;
};

/// The volume that an engine of makeEngineOpenCl holds, for kernels that run beside the engine's own.
/// @throws std::invalid_argument when it is another engine or holds none.
const OpenClVolume& openClVolume(const Engine& engine);

}  // namespace xray_registration
