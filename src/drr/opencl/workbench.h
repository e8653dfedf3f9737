#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <vector>

#include "xray_registration/drr/engine.h"
#include "xray_registration/drr/opencl/launch.h"
#include "xray_registration/drr/opencl/layout.h"
#include "xray_registration/drr/opencl/opencl_device.h"

namespace xray_registration {

/// The fast method's kernels, compiled for one way of sharing rays.
struct FastKernels {
  cl::Program program;
  std::size_t items_per_tile = layout::kRays;
  cl::Kernel plan, render, render_derivatives, motion_sums, body_sums, windows, halve_xray, used_tiles, leave_out_tiles,
      surround, unexplained, apply_map, outline, match_everywhere, match_shown;
  std::vector<cl::Kernel> sums;  ///< One for each similarity.

  /// So many rays or more that one work-item's inner loop is not cut short.
  int wholeLanes(int rays) const {
    const int lanes = layout::kRays / static_cast<int>(items_per_tile);
    return (rays + lanes - 1) / lanes * lanes;
  }

  /// For kernels whose work-items take LANES rays each.
  LaunchRange perRay(int rays) const {
    return groupsOf(items_per_tile, static_cast<std::size_t>((rays + layout::kRays - 1) / layout::kRays));
  }
};

/// An engine's device, kernels and queue; keeps the books of what was asked of them. Not thread-safe.
class Workbench {
 public:
  /// Compiles for rays that are not shared. @throws DeviceError.
  explicit Workbench(std::shared_ptr<Device> device);

  const Device& device() const { return *device_; }
  const cl::CommandQueue& queue() const { return device_->openCl().solve_queue; }
  const EngineWork& work() const { return work_; }

  /// Compiled when first asked for; `split` work-items share a ray.
  FastKernels& kernels(int split = 1);

  cl::Buffer newBuffer(std::size_t bytes);

  /// Waits until nothing is queued, whatever the device says: before memory goes that it still reads.
  void settle() const noexcept;

  template <typename... Arguments>
  void run(cl::Kernel* kernel, const LaunchRange& range, const Arguments&... arguments) {
    ++work_.launches;
    launch(queue(), kernel, range, arguments...);
  }

  /// Work-items of a group that compares shifts: one takes all of them on a CPU.
  std::size_t itemsOfShifts() const { return device_->isGpu() ? layout::kShiftsAtOnce : 1; }

  void countHalving() { ++work_.halvings; }

 private:
  std::shared_ptr<Device> device_;
  std::map<int, FastKernels> kernels_;
  EngineWork work_;
};

/// At least `items` work-items of a kernel that does not march.
inline LaunchRange perItem(int items) { return atLeast(static_cast<std::size_t>(items), layout::kRays); }

/// A buffer that is made anew only when it is too small.
class GrowingBuffer {
 public:
  const cl::Buffer& atLeast(std::size_t bytes, Workbench* bench);
  const cl::Buffer& get() const { return buffer_; }

 private:
  cl::Buffer buffer_;
  std::size_t bytes_ = 0;
};

/// Numbers on their way to the device: what a queued write still reads may not be filled anew.
class Staging {
 public:
  /// The numbers to fill in, once the last write is through.
  std::vector<float>& refill();
  /// Queues the write, without waiting for it.
  const cl::Buffer& writeTo(GrowingBuffer* buffer, Workbench* bench);

 private:
  std::vector<float> floats_;
  cl::Event written_;
};

}  // namespace xray_registration
