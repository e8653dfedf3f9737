#pragma once

#include <array>
#include <cstdint>

#include "xray_registration/image/image.h"

namespace xray_registration {

/// Red, green, blue.
using Rgb = std::array<std::uint8_t, 3>;
using RgbImage = Image<Rgb>;

/// What the edges are drawn in.
enum class OverlayColour {
  kAccepted,  ///< Green.
  kRefused,   ///< Red: a pose that is not to be trusted must not look like one that is.
};

/// The X-ray in grey (bones bright) with the DRR's edges in colour; pixels that the mask leaves out are tinted blue (an
/// empty mask leaves out none). An empty DRR draws no edges.
/// @throws std::invalid_argument when the images' sizes differ.
RgbImage drawOverlay(const FloatImage& attenuation, const MaskImage& mask, const FloatImage& drr, OverlayColour colour);

}  // namespace xray_registration
