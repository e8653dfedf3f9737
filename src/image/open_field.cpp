#include <algorithm>
#include <cmath>
#include <vector>

#include "xray_registration/common/statistics.h"
#include "xray_registration/image/xray_frame.h"

namespace xray_registration {
namespace {

constexpr double kPercentile = 0.995;
constexpr std::size_t kSamples = 65536;
/// With fewer unsaturated pixels than this share, their percentile says nothing about the beam.
constexpr double kFewestUnsaturated = 0.01;

}  // namespace

double estimateOpenField(const FloatImage& transmission, double saturation_value) {
  const bool saturates = std::isfinite(saturation_value) && saturation_value > 0.0;
  // A stride without a common factor with usual widths walks over all columns.
  const std::size_t stride = std::max<std::size_t>(1, transmission.pixels.size() / kSamples) | 1U;
  std::vector<float> unsaturated;
  unsaturated.reserve(transmission.pixels.size() / stride + 1);
  std::size_t looked_at = 0;
  for (std::size_t i = 0; i < transmission.pixels.size(); i += stride, ++looked_at) {
    if (!saturates || transmission.pixels[i] < saturation_value) unsaturated.push_back(transmission.pixels[i]);
  }
  if (unsaturated.size() < kFewestUnsaturated * static_cast<double>(looked_at) || unsaturated.empty()) {
    return saturates ? saturation_value : 0.0;
  }
  return quantileBelow(&unsaturated, kPercentile);
}

}  // namespace xray_registration
