#pragma once

#include <utility>

#include "xray_registration/image/image.h"

namespace xray_registration {

/// Pixel values as the detector sent them: whole numbers up to 65535 as such, all else in float. One of both is empty.
struct RawPixels {
  FloatImage floats;
  CountImage counts;

  RawPixels() = default;
  RawPixels(FloatImage image) : floats(std::move(image)) {}  // NOLINT(google-explicit-constructor): nothing is lost.
  RawPixels(CountImage image) : counts(std::move(image)) {}  // NOLINT(google-explicit-constructor)

  int width() const { return counts.empty() ? floats.width : counts.width; }
  int height() const { return counts.empty() ? floats.height : counts.height; }
};

/// The same in float.
FloatImage floatsOf(const RawPixels& pixels);

/// Pixels and the largest value that the encoding can hold.
struct RawImage {
  RawPixels pixels;
  double saturation = 0.0;  ///< 255 or 65535; for floats the largest finite one, which no detector reaches.
};

}  // namespace xray_registration
