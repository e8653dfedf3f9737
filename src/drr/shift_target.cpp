#include "xray_registration/drr/shift_target.h"

#include <algorithm>

namespace xray_registration {

XrayCamera ShiftTarget::widened() const {
  return camera.cropped(-reach, -reach, camera.width + 2 * reach, camera.height + 2 * reach);
}

FloatImage detailOf(const FloatImage& image, const MaskImage& mask, int radius) {
  FloatImage detail(image.width, image.height);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      double sum = 0.0;
      double count = 0.0;
      for (int y = std::max(v - radius, 0); y <= std::min(v + radius, image.height - 1); ++y) {
        for (int x = std::max(u - radius, 0); x <= std::min(u + radius, image.width - 1); ++x) {
          if (mask.at(x, y) == 0) continue;
          sum += image.at(x, y);
          count += 1.0;
        }
      }
      if (mask.at(u, v) != 0) detail.at(u, v) = image.at(u, v) - static_cast<float>(sum / count);
    }
  }
  return detail;
}

}  // namespace xray_registration
