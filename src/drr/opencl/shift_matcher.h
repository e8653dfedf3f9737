#pragma once

#include <cstddef>
#include <vector>

#include "drr/opencl/workbench.h"
#include "xray_registration/drr/shift_target.h"

namespace xray_registration {

/// Pixels behind the last DRR that the kernels may read.
constexpr std::size_t kPixelsBehindShifts = layout::kShiftsAtOnce;

/// Compares DRRs on the device with a small X-ray at all shifts. Not thread-safe.
class ShiftMatcher {
 public:
  /// `drrs`: one behind the other, of the target's widened camera, and kPixelsBehindShifts pixels more.
  std::vector<float> match(const ShiftTarget& target, const cl::Buffer& drrs, std::size_t poses, Workbench* bench);

 private:
  void upload(const ShiftTarget& target, Workbench* bench);
  void matchShown(const ShiftTarget& target, const cl::Buffer& drrs, std::size_t poses, Workbench* bench);

  GrowingBuffer xray_, detail_, shown_, correlations_;
  Staging staging_;
  float pixels_ = 0.0F;  ///< That are used.
  float power_ = 0.0F;   ///< Sum of their squares.
};

}  // namespace xray_registration
