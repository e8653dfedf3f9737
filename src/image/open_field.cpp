#include "image/open_field.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "xray_registration/common/statistics.h"
#include "xray_registration/image/xray_frame.h"

namespace xray_registration {
namespace {

constexpr double kPercentile = 0.995;
/// With fewer unsaturated pixels than this share, their percentile says nothing about the beam.
constexpr double kFewestUnsaturated = 0.01;

}  // namespace

double estimateOpenField(const FloatImage& transmission, double saturation_value) {
  return openFieldOf(spreadSamples(transmission), saturation_value);
}

double openFieldOf(const std::vector<float>& samples, double saturation_value) {
  const bool saturates = std::isfinite(saturation_value) && saturation_value > 0.0;
  std::vector<float> unsaturated;
  unsaturated.reserve(samples.size());
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(unsaturated),
               [&](float sample) { return !saturates || sample < saturation_value; });
  if (unsaturated.size() < kFewestUnsaturated * static_cast<double>(samples.size()) || unsaturated.empty()) {
    return saturates ? saturation_value : 0.0;
  }
  return quantileBelow(&unsaturated, kPercentile);
}

}  // namespace xray_registration
