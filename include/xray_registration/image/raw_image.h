#pragma once

#include "xray_registration/image/image.h"

namespace xray_registration {

/// Pixel values as the detector sent them, in float, and the largest value that the encoding can hold.
struct RawImage {
  FloatImage pixels;
  double saturation = 0.0;  ///< 255 or 65535; for floats the largest finite one, which no detector reaches.
};

}  // namespace xray_registration
