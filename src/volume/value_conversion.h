#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "file_image.h"

namespace xray_registration {

/// What a voxel without a value becomes: air in a CT, background in a label image.
template <typename To>
constexpr To backgroundOf() {
  return std::is_same<To, std::int16_t>::value ? static_cast<To>(-1000) : static_cast<To>(0);
}

/// Rounded to the nearest number of the type, clamped to its range.
template <typename To>
To roundedTo(double value) {
  constexpr double kLow = std::numeric_limits<To>::lowest();
  constexpr double kHigh = std::numeric_limits<To>::max();
  const double inside = std::min(std::max(kLow, value), kHigh);  // What is no number becomes the lowest.
  return static_cast<To>(inside < 0.0 ? inside - 0.5 : inside + 0.5);
}

/// The file's own rescaling: value = slope · stored + intercept.
struct StoredScale {
  double slope = 1.0;
  double intercept = 0.0;
};

/// Turns stored numbers into HU or labels, and adds to the facts what was met.
template <typename From, typename To>
void convertValues(const From* in, std::size_t count, const StoredScale& scale, const FileRule& rule, To* out,
                   ValueFacts* facts) {
  ValueFacts seen;
  seen.eight_bits = sizeof(From) == 1;
  const bool has_padding = rule.padding.has_value();
  const double padding = rule.padding.value_or(0.0);
  const double padding_tolerance = 1e-6 * std::max(1.0, std::abs(padding));  // Single precision in the file.
  for (std::size_t i = 0; i < count; ++i) {
    const double value = static_cast<double>(in[i]) * scale.slope + scale.intercept;
    if (std::is_floating_point<From>::value && !std::isfinite(value)) {
      ++seen.not_finite;
      out[i] = backgroundOf<To>();
      continue;
    }
    if (has_padding && std::abs(value - padding) <= padding_tolerance) {
      ++seen.padded;
      out[i] = backgroundOf<To>();
      continue;
    }
    seen.low = std::min(seen.low, value);
    seen.high = std::max(seen.high, value);
    out[i] = roundedTo<To>(value * rule.slope + rule.intercept);
  }
  facts->add(seen);
}

/// The same where the stored numbers have the type that is wanted and nothing is to be done: looks at them alone.
template <typename T>
void noteValues(const T* values, std::size_t count, ValueFacts* facts) {
  T low = std::numeric_limits<T>::max();
  T high = std::numeric_limits<T>::lowest();
  for (std::size_t i = 0; i < count; ++i) {
    low = std::min(low, values[i]);
    high = std::max(high, values[i]);
  }
  ValueFacts seen;
  if (count > 0) {
    seen.low = low;
    seen.high = high;
  }
  facts->add(seen);
}

inline bool changesNothing(const StoredScale& scale, const FileRule& rule) {
  return scale.slope == 1.0 && scale.intercept == 0.0 && rule.slope == 1.0 && rule.intercept == 0.0 && !rule.padding;
}

}  // namespace xray_registration
