#pragma once

#include <string>
#include <vector>

#include "tools/benchmark/measure.h"

namespace xray_registration::tools {

/// One number to reach and what was measured.
struct Goal {
  std::string what;
  double value = 0.0;
  bool at_least = false;  ///< The value shall be at least the limit, else at most.
  double limit = 0.0;
  std::string unit;  ///< "x" for a ratio.
  bool met() const { return at_least ? value >= limit : value <= limit; }
};

/// The goals that the rows say something about. `gpu` adds those that hold for GPUs alone.
std::vector<Goal> goalsOf(const std::vector<BenchmarkRow>& rows, bool gpu);

}  // namespace xray_registration::tools
