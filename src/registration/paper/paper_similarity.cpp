#include <algorithm>
#include <cmath>

#include "xray_registration/registration/paper/paper_registrar.h"

namespace xray_registration {
namespace {

/// Deviation, in line integrals, below which a window is flat: it has nothing to be compared.
constexpr double kFlat = 0.02;

struct WindowSums {
  int count = 0;
  double f = 0.0;
  double g = 0.0;
  double ff = 0.0;
  double gg = 0.0;
  double fg = 0.0;
};

WindowSums windowAt(const FloatImage& xray, const FloatImage& drr, const MaskImage& mask, int u, int v, int radius) {
  WindowSums sums;
  for (int y = std::max(v - radius, 0); y <= std::min(v + radius, drr.height - 1); ++y) {
    for (int x = std::max(u - radius, 0); x <= std::min(u + radius, drr.width - 1); ++x) {
      if (!mask.empty() && mask.at(x, y) == 0) continue;
      const double f = drr.at(x, y);
      const double g = xray.at(x, y);
      ++sums.count;
      sums.f += f;
      sums.g += g;
      sums.ff += f * f;
      sums.gg += g * g;
      sums.fg += f * g;
    }
  }
  return sums;
}

}  // namespace

double meanLocalCorrelation(const FloatImage& xray, const FloatImage& drr, const MaskImage& mask, int radius) {
  const int side = 2 * radius + 1;
  double sum = 0.0;
  int windows = 0;
  // Every second pixel: neighbouring windows say nearly the same.
  for (int v = 0; v < drr.height; v += 2) {
    for (int u = 0; u < drr.width; u += 2) {
      if (!(drr.at(u, v) > 0.0F) || (!mask.empty() && mask.at(u, v) == 0)) continue;
      const WindowSums w = windowAt(xray, drr, mask, u, v, radius);
      if (2 * w.count < side * side) continue;
      const double n = w.count;
      const double variance_f = std::max(w.ff / n - w.f / n * (w.f / n), 0.0);
      const double variance_g = std::max(w.gg / n - w.g / n * (w.g / n), 0.0);
      if (variance_f < kFlat * kFlat) continue;
      sum += (w.fg / n - w.f / n * (w.g / n)) / std::sqrt(variance_f * (variance_g + 1e-12));
      ++windows;
    }
  }
  return windows > 0 ? std::clamp(sum / windows, -1.0, 1.0) : 0.0;
}

}  // namespace xray_registration
