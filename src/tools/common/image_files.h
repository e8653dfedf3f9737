#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "xray_registration/image/image.h"

namespace xray_registration::tools {

/// An 8-bit PNG; `low` becomes black and `high` white, and the other way round when low > high.
/// @throws std::runtime_error naming the file when it cannot be written.
void writeGreyPng(const std::string& path, const FloatImage& image, double low, double high);

/// The same from the image's smallest to its largest value, or the reverse for a picture as on film (bones bright).
void writeGreyPng(const std::string& path, const FloatImage& image);

/// Float values as MetaImage (.mha), pixel spacing 1.
void writeMha(const std::string& path, const FloatImage& image);

/// RGB, row by row.
struct ColourImage {
  int width = 0;
  int height = 0;
  std::vector<std::array<std::uint8_t, 3>> pixels;
};

/// The X-ray in grey, the DRR's edges over it in orange: what does not fit is seen at once. Pixels that the mask leaves
/// out (an empty mask leaves out none) are tinted blue.
ColourImage edgesOver(const FloatImage& xray, const FloatImage& drr, const MaskImage& mask);

void writeColourPng(const std::string& path, const ColourImage& image);

}  // namespace xray_registration::tools
