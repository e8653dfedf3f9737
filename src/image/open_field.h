#pragma once

#include <algorithm>
#include <vector>

#include "xray_registration/image/image.h"

namespace xray_registration {

/// At most about 2¹⁶ pixels, evenly spread, as floats.
template <typename Pixel>
std::vector<float> spreadSamples(const Image<Pixel>& image) {
  constexpr std::size_t kSamples = 65536;
  // A stride without a common factor with usual widths walks over all columns.
  const std::size_t stride = std::max<std::size_t>(1, image.pixels.size() / kSamples) | 1U;
  std::vector<float> samples;
  samples.reserve(image.pixels.size() / stride + 1);
  for (std::size_t i = 0; i < image.pixels.size(); i += stride) samples.push_back(static_cast<float>(image.pixels[i]));
  return samples;
}

/// estimateOpenField of such samples of a transmission.
double openFieldOf(const std::vector<float>& samples, double saturation_value);

}  // namespace xray_registration
