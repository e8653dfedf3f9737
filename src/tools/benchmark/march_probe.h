#pragma once

#include <memory>
#include <vector>

#include "xray_registration/drr/opencl/opencl_volume.h"
#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/xray_camera.h"

namespace xray_registration::tools {

/// What the engine's march has to do for one image, and how fast the device could do it at best. Runs the engine's own
/// plan, and kernels of its own on the same rays (kernels/ceiling.cl). Not thread-safe.
class MarchProbe {
 public:
  /// Compiles. @throws DeviceError.
  explicit MarchProbe(std::shared_ptr<Device> device);

  /// Plans the march of an image of `camera` through the finest level of the engine's CT, as the engine does. The CT
  /// must stay. @throws std::invalid_argument when the engine holds no CT on an OpenCL device.
  void plan(const Engine& engine, const XrayCamera& camera, const RigidTransform& T_camera_ct);

  /// March samples of the planned image: pixels of each tile times the slices between the first and the last brick of
  /// its frustum that holds tissue, summed. Slices outside are air and are not marched.
  double samples() const { return samples_; }
  /// Bytes that those samples load: two words each; four where the dominant axis is z and there are words alone.
  double loadedBytes() const { return loaded_bytes_; }

  /// The planned tiles', row by row: dominant axis, first and last slice, whether used.
  std::vector<cl_int4> plans() const;

  /// Loads every word that the march loads, at the same places in the same order, and nothing else; device time, ms.
  double loadsOnlyMs();

  /// Copies a buffer of `bytes`; bytes read and written per second of device time.
  double copyBytesPerSecond(std::size_t bytes);

 private:
  void countSamples(const XrayCamera& camera);

  std::shared_ptr<Device> device_;
  cl::Program program_;
  cl::Kernel plan_, loads_only_, copy_;
  std::size_t items_per_tile_ = 64;
  const OpenClLevel* level_ = nullptr;
  int tiles_x_ = 0;
  int tiles_ = 0;
  cl::Buffer poses_, plans_, out_;
  double samples_ = 0.0;
  double loaded_bytes_ = 0.0;
};

}  // namespace xray_registration::tools
