#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

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

constexpr Rgb kAcceptedColour = {40, 255, 80};
constexpr Rgb kRefusedColour = {255, 50, 40};

/// Of a body by its number: neither the CT's green, nor red, nor what a mask is tinted with. They come again after
/// five.
Rgb bodyColour(std::size_t body);

/// A part of the DRR whose edges are drawn.
struct OverlayLine {
  const FloatImage* drr = nullptr;  ///< Not empty.
  Rgb colour = kAcceptedColour;
  bool dashed = false;
};

/// The same with the edges of several parts, the last on top.
RgbImage drawOverlay(const FloatImage& attenuation, const MaskImage& mask, const std::vector<OverlayLine>& lines);

}  // namespace xray_registration
