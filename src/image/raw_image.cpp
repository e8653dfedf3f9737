#include "xray_registration/image/raw_image.h"

#include <algorithm>

namespace xray_registration {

FloatImage floatsOf(const RawPixels& pixels) {
  const CountImage& counts = pixels.counts;
  if (counts.empty()) return pixels.floats;
  FloatImage result(counts.width, counts.height);
  std::copy(counts.pixels.begin(), counts.pixels.end(), result.pixels.begin());
  return result;
}

}  // namespace xray_registration
