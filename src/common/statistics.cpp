#include "xray_registration/common/statistics.h"

#include <cmath>
#include <utility>

namespace xray_registration {

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const double rank = share * static_cast<double>(values.size() - 1);
  const std::size_t rank_below = static_cast<std::size_t>(std::floor(rank));
  const double below = valueOfRank(&values, rank_below);
  const double part = rank - static_cast<double>(rank_below);
  if (part == 0.0) return below;
  // What stands behind the selected value is not smaller.
  const double above = *std::min_element(values.begin() + static_cast<std::ptrdiff_t>(rank_below) + 1, values.end());
  // Equal neighbours may both be infinite, and their difference no number.
  return below == above ? below : below + part * (above - below);
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

double largest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

Percentiles percentiles(const std::vector<double>& values) {
  return {quantile(values, 0.5), quantile(values, 0.95), quantile(values, 0.99)};
}

}  // namespace xray_registration
