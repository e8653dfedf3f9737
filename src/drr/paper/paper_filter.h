#pragma once

#include <vector>

#include "xray_registration/image/image.h"

namespace xray_registration {

/// Half of a Gaussian's taps: weight of offset 0, 1, … radius; not normalised. Empty for sigma ≤ 0.
std::vector<float> gaussianTaps(double sigma_px);

/// Weights per pixel, 1 where the mask allows and 0 elsewhere; an empty mask allows all.
FloatImage weightsOf(const MaskImage& mask, int width, int height);

/// Separable correlation with symmetric taps; pixels outside count as zero.
void blur(const FloatImage& in, const std::vector<float>& half_taps, FloatImage* scratch, FloatImage* out);

/// 1 / blur(weights), and 0 where no weight was met.
FloatImage inverseBlurredWeights(const FloatImage& weights, const std::vector<float>& half_taps);

}  // namespace xray_registration
