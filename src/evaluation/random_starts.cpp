#include "xray_registration/evaluation/random_starts.h"

#include <cmath>

namespace xray_registration {

double RandomStarts::uniform(double low, double high) {
  // The upper 53 bits fill a double's mantissa: exact on every platform.
  const double zero_to_one = static_cast<double>(bits_() >> 11U) * 0x1.0p-53;
  return low + (high - low) * zero_to_one;
}

Eigen::Vector3d RandomStarts::unitVector() {
  // Rejection from the cube: uniform on the sphere without sines that differ in their last bit between libraries.
  while (true) {
    const double x = uniform(-1.0, 1.0);
    const double y = uniform(-1.0, 1.0);
    const double z = uniform(-1.0, 1.0);
    const double squared = x * x + y * y + z * z;
    if (squared <= 1.0 && squared > 1e-4) return Eigen::Vector3d(x, y, z) / std::sqrt(squared);
  }
}

Twist RandomStarts::next() {
  Twist disturbance;
  const Eigen::Vector3d axis = unitVector();
  disturbance.tail<3>() = axis * uniform(-range_.rotation_rad, range_.rotation_rad);
  for (int i = 0; i < 3; ++i) disturbance(i) = uniform(-range_.translation_mm, range_.translation_mm);
  return disturbance;
}

}  // namespace xray_registration
