#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "xray_registration/drr/device.h"
#include "xray_registration/drr/ray_motion.h"
#include "xray_registration/drr/resident_volume.h"
#include "xray_registration/drr/resident_xray.h"
#include "xray_registration/drr/shift_target.h"
#include "xray_registration/drr/similarity.h"
#include "xray_registration/drr/step_sums.h"
#include "xray_registration/drr/tile_products.h"
#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// What an engine has asked of its device since it was made.
struct EngineWork {
  std::size_t buffers = 0;   ///< Made, the CT's own left out.
  std::size_t launches = 0;  ///< Of kernels.
  std::size_t halvings = 0;  ///< Levels of X-rays made from the level above.
};

/// The fast method's device side: Joseph's projector on packed voxels with the derivatives in the same march (P. M.
/// Joseph, 1982), sums per tile, normal equations per window. Everything is summed in a fixed order: the same input
/// gives the same bits on the same device. X-rays belong to the engine that uploaded them. Not thread-safe.
/// @throws DeviceError from every call.
class Engine {
 public:
  virtual ~Engine() = default;

  virtual void setVolume(const AttenuationVolume& volume) = 0;
  virtual bool hasVolume() const = 0;
  virtual const ResidentVolume& volume() const = 0;  ///< hasVolume() holds.
  virtual void releaseVolume() = 0;

  /// Transfers an X-ray (weights 0 … 1 per pixel, the image's size). Its levels, until a side is below 32 pixels, are
  /// made when they are first needed. The memory of X-rays that are gone is used again.
  virtual std::unique_ptr<ResidentXray> upload(const XrayCamera& camera, const FloatImage& attenuation,
                                               const FloatImage& weight) = 0;

  /// An engine without a CT on the same device, with the same kernels, for another body: X-rays belong to both.
  virtual std::unique_ptr<Engine> sibling() = 0;

  /// The same X-ray for another body: pixels and weights are shared (and not its own to weigh), which tiles are used,
  /// what surrounds the body, and saturation are its own.
  virtual std::unique_ptr<ResidentXray> share(ResidentXray* xray) = 0;

  /// Line integrals add: this engine's CT, as seen from a pose, becomes part of what surrounds the body that looks at
  /// this level of the X-ray; on the tiles that are used. Evaluations then compare the X-ray with the sum.
  virtual void surround(ResidentXray* xray, int xray_level, int volume_level, const RigidTransform& T_camera_ct) = 0;

  /// What another look at the same X-ray has around it on this level, in place of what this one has: drawn once, for
  /// several bodies. On tiles that the other one does not use it is not known.
  virtual void surroundAs(ResidentXray* xray, int xray_level, ResidentXray* other) = 0;

  /// Lowers the weights where rays leave the CT through a cut face with tissue on it (the body goes on, the CT does
  /// not), smoothly, as seen from a pose; `limit` is the line integral of unexplained tissue that halves a weight.
  /// Returns the mean factor over the image: 1 when every ray is explained.
  virtual double weighUnexplained(ResidentXray* xray, const RigidTransform& T_camera_ct, double limit) = 0;

  /// Back to the weights as uploaded.
  virtual void restoreWeights(ResidentXray* xray) = 0;

  /// Uses only the `part` of a level's tiles in which the X-ray varies most: they carry nearly all information, and the
  /// march costs by the tile. Weighing anew brings all tiles back, and so does useAllTiles.
  virtual void keepContrastTiles(ResidentXray* xray, int xray_level, double part) = 0;
  virtual void useAllTiles(ResidentXray* xray) = 0;

  /// Objective and normal equations for many poses of one level of an X-ray in one launch.
  virtual std::vector<StepSums> evaluate(ResidentXray* xray, int xray_level, int volume_level,
                                         const std::vector<RigidTransform>& T_camera_ct,
                                         const WindowOptions& options) = 0;

  /// Correlation of each window (span² tiles, row by row) of the last evaluate's first pose; −2 where a window was left
  /// out.
  virtual std::vector<float> windowCorrelations() = 0;

  /// Sums per tile of one level of an X-ray with the derivatives by any motions of its rays, at most kMostRayMotions,
  /// for who asks more than the pose. The level may be looked at by another camera than it was uploaded with, and the
  /// CT may be stretched or mirrored.
  virtual TileProducts addUpTiles(ResidentXray* xray, int xray_level, int volume_level, const XrayCamera& camera,
                                  const Eigen::Affine3d& T_camera_ct, const std::vector<RayMotion>& motions) = 0;

  /// Sums per tile of (1, DRR with all that surrounds the body, X-ray, the six derivatives by the twist about the
  /// body's centre, the body's own part of the DRR): TileProducts of ten vectors.
  virtual TileProducts addUpBody(ResidentXray* xray, int xray_level, int volume_level,
                                 const RigidTransform& T_camera_body) = 0;

  /// Line integrals.
  virtual FloatImage render(const XrayCamera& camera, int volume_level, const RigidTransform& T_camera_ct) = 0;

  /// How well the DRRs of many poses resemble a small X-ray at all shifts: normalised correlations, −1…1, and −1 where
  /// nothing can be compared; for each pose rows of shifts() columns. At column a, row b a DRR was moved by
  /// (reach − a, reach − b) pixels.
  virtual std::vector<float> matchShifts(const ShiftTarget& target, int volume_level,
                                         const std::vector<RigidTransform>& T_camera_ct) = 0;

  /// The line integral image and its six derivatives by the twist about the CT's centre, for tests.
  virtual std::vector<FloatImage> renderWithDerivatives(const XrayCamera& camera, int volume_level,
                                                        const RigidTransform& T_camera_ct) = 0;

  /// Work-items that share one ray: 1, 2 or 4. Zero lets the engine choose by the device's size.
  virtual void forceSplit(int split) = 0;

  /// Device time of the kernels of the last evaluate or render, ms, by the device's own clock.
  struct KernelTimes {
    double plan_ms = 0.0;
    double march_ms = 0.0;
    double windows_ms = 0.0;
  };
  virtual KernelTimes lastKernelTimes() const = 0;

  virtual EngineWork work() const = 0;
  virtual const Device& device() const = 0;
};

/// OpenCL 1.2. Compiles the kernels. @throws DeviceError.
std::unique_ptr<Engine> makeEngineOpenCl(std::shared_ptr<Device> device);

}  // namespace xray_registration
