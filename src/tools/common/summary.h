#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace xray_registration::tools {

/// Upper median; 0 of nothing.
inline double medianOf(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// 0 of nothing.
inline double largestOf(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

}  // namespace xray_registration::tools
