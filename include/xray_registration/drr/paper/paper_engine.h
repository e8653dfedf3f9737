#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>

#include "xray_registration/common/log.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/drr/paper/paper_rays.h"
#include "xray_registration/image/image.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// Linear filter of target and DRRs before they are compared; both zero is the paper's plain comparison. Gaussians over
/// the pixels that the mask allows (weighted, normalised by the weights they met). Being linear it leaves Gauss-Newton
/// exact. An addition to the paper, for X-rays: scatter is a smooth background that no DRR has.
struct PaperFilter {
  double smooth_sigma_px = 0.0;      ///< Removes what is finer.
  double background_sigma_px = 0.0;  ///< Removes what is coarser.
};

/// Sums of products over the allowed pixels of the nine images [∂f/∂s₁ … ∂f/∂s₆, f, 1, g − f], in this order: all that
/// a Gauss-Newton step needs, with or without gain and offset.
using PaperMoments = Eigen::Matrix<double, 9, 9>;

/// Images that the engine keeps: slot 0 is f(s), slot k = 1 … 6 is f(s + h_k e_k).
constexpr int kPaperSlots = 7;

/// The image side of the paper's method: concentric-sphere ray casting with tri-linear interpolation, forward
/// differences and the reduction to normal equations. Two implementations with equal results up to float rounding.
/// Values outside the volume are air. Not thread-safe.
class PaperEngine {
 public:
  virtual ~PaperEngine() = default;

  /// Takes the CT; values become float attenuation in 1/mm. @throws DeviceError when the device has no room.
  virtual void setVolume(const AttenuationVolume& volume) = 0;

  /// The image to be matched; its size is that of all further images. Pixels where the mask (empty: none) is zero are
  /// left out.
  virtual void setTarget(const FloatImage& target, const MaskImage& mask, const PaperFilter& filter) = 0;

  /// Renders into a slot. The rays' size must be the target's. May return before the device is done.
  virtual void render(int slot, const PaperRays& rays) = 0;

  /// Waits for the device.
  virtual void finish() = 0;

  /// The unfiltered image of a slot.
  virtual FloatImage read(int slot) = 0;

  /// Filters target and slots when asked for, and reduces; `steps` are the h_k of slots 1 … 6.
  virtual PaperMoments moments(const std::array<double, 6>& steps) = 0;

  virtual const VolumeGrid& grid() const = 0;
  virtual std::string name() const = 0;
  virtual std::size_t deviceBytes() const = 0;
};

/// Plain single-threaded C++: the paper's other column and the reference of the OpenCL one.
std::unique_ptr<PaperEngine> makePaperEngineCpp();

/// OpenCL 1.2 on `device`. Summation order is fixed: the same input gives the same bits on the same device.
std::unique_ptr<PaperEngine> makePaperEngineOpenCl(std::shared_ptr<Device> device);

/// Renders a small scene on `engine` and in plain C++ and compares images and moments; replaces the engine's volume.
/// @throws DeviceError when they disagree.
void checkPaperEngine(PaperEngine* engine);

}  // namespace xray_registration
