#include "drr/paper/paper_filter.h"

#include <algorithm>
#include <cmath>

namespace xray_registration {

std::vector<float> gaussianTaps(double sigma_px) {
  std::vector<float> taps;
  if (!(sigma_px > 0.0)) return taps;
  const int radius = std::max(1, static_cast<int>(std::ceil(2.5 * sigma_px)));
  for (int i = 0; i <= radius; ++i) {
    taps.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px))));
  }
  return taps;
}

FloatImage weightsOf(const MaskImage& mask, int width, int height) {
  FloatImage weights(width, height, 1.0F);
  if (mask.empty()) return weights;
  for (std::size_t i = 0; i < weights.pixels.size(); ++i) weights.pixels[i] = mask.pixels[i] != 0 ? 1.0F : 0.0F;
  return weights;
}

void blur(const FloatImage& in, const std::vector<float>& half_taps, FloatImage* scratch, FloatImage* out) {
  const int radius = static_cast<int>(half_taps.size()) - 1;
  *scratch = FloatImage(in.width, in.height);
  *out = FloatImage(in.width, in.height);
  for (int v = 0; v < in.height; ++v) {
    for (int u = 0; u < in.width; ++u) {
      float sum = 0.0F;
      for (int x = std::max(u - radius, 0); x <= std::min(u + radius, in.width - 1); ++x) {
        sum += half_taps[static_cast<std::size_t>(std::abs(x - u))] * in.at(x, v);
      }
      scratch->at(u, v) = sum;
    }
  }
  for (int v = 0; v < in.height; ++v) {
    for (int y = std::max(v - radius, 0); y <= std::min(v + radius, in.height - 1); ++y) {
      const float tap = half_taps[static_cast<std::size_t>(std::abs(y - v))];
      for (int u = 0; u < in.width; ++u) out->at(u, v) += tap * scratch->at(u, y);
    }
  }
}

FloatImage inverseBlurredWeights(const FloatImage& weights, const std::vector<float>& half_taps) {
  FloatImage scratch;
  FloatImage inverse;
  blur(weights, half_taps, &scratch, &inverse);
  for (float& value : inverse.pixels) value = value > 1e-6F ? 1.0F / value : 0.0F;
  return inverse;
}

}  // namespace xray_registration
