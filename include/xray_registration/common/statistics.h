#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace xray_registration {

/// The value that would stand at `rank` (from 0) if the values were sorted. Reorders them. Linear in their number.
template <typename Value>
Value valueOfRank(std::vector<Value>* values, std::size_t rank) {
  const auto place = values->begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values->begin(), place, values->end());
  return *place;
}

/// The value at the rank share · (n − 1), rounded down: one of the values itself, as suits pixels and weights. Reorders
/// them; there must be one at least. `share` in [0, 1].
template <typename Value>
Value quantileBelow(std::vector<Value>* values, double share) {
  return valueOfRank(values, static_cast<std::size_t>(share * static_cast<double>(values->size() - 1)));
}

/// The value at the rank share · (n − 1), interpolated between its neighbours; 0 of nothing. `share` in [0, 1].
/// Infinite values are allowed.
double quantile(std::vector<double> values, double share);

/// 0 of nothing.
double median(std::vector<double> values);
double largest(const std::vector<double>& values);

/// What reports say of times and errors.
struct Percentiles {
  double median = 0.0;
  double p95 = 0.0;
  double p99 = 0.0;
};

/// Quantiles 0.5, 0.95 and 0.99; zeros of nothing.
Percentiles percentiles(const std::vector<double>& values);

}  // namespace xray_registration
