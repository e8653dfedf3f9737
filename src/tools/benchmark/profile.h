#pragma once

#include <memory>
#include <vector>

#include "xray_registration/drr/device.h"

namespace xray_registration::tools {

/// Where a step's time goes and how near its march is to what the device can do. Medians over the rounds; milliseconds
/// of device time by the kernels' events, but for `step_ms`.
struct StepProfile {
  int n = 0;             ///< n³ CT, n² image.
  char axis = 'z';       ///< The volume's axis along which the rays march.
  double step_ms = 0.0;  ///< Whole step by the host's clock.
  double plan_ms = 0.0;
  double march_ms = 0.0;  ///< Value, derivatives and the tiles' 45 sums.
  double windows_ms = 0.0;
  double drr_march_ms = 0.0;   ///< The march of a DRR alone.
  double loads_only_ms = 0.0;  ///< The same loads and nothing else.
  double samples = 0.0;
  double loaded_bytes = 0.0;  ///< By all loads, wherever they are answered from.
  double volume_bytes = 0.0;  ///< The CT's finest level: what memory has to deliver at least when no cache holds it.

  /// Queue, transfer and host.
  double restMs() const { return step_ms - plan_ms - march_ms - windows_ms; }
  double loadedBytesPerSecond() const { return loaded_bytes / (march_ms * 1e-3); }
};

struct Ceiling {
  std::vector<StepProfile> profiles;
  double copy_bytes_per_second = 0.0;  ///< Read and written, buffers far larger than the caches.
};

/// Steps at 128 and 256 along z and x, in turns.
Ceiling measureCeiling(const std::shared_ptr<Device>& device, int rounds, bool quick);

}  // namespace xray_registration::tools
