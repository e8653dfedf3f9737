#include "registration/residual_statistics.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace xray_registration {
namespace {

constexpr int kTile = 8;
constexpr int kPixels = kTile * kTile;

struct Moments {
  double variance = 0.0;
  double along_u = 0.0;
  double along_v = 0.0;
};

/// Adds a tile's residual products after its gain and offset are taken out.
void addTile(const FloatImage& drr, const FloatImage& xray, int u0, int v0, Moments* moments) {
  double d = 0.0, x = 0.0, dd = 0.0, dx = 0.0;
  for (int v = v0; v < v0 + kTile; ++v) {
    for (int u = u0; u < u0 + kTile; ++u) {
      d += drr.at(u, v);
      x += xray.at(u, v);
      dd += static_cast<double>(drr.at(u, v)) * drr.at(u, v);
      dx += static_cast<double>(drr.at(u, v)) * xray.at(u, v);
    }
  }
  const double variance = dd - d * d / kPixels;
  const double gain = variance > 1e-9 ? (dx - d * x / kPixels) / variance : 0.0;
  const double offset = (x - gain * d) / kPixels;
  std::array<double, kPixels> r{};
  for (int i = 0; i < kPixels; ++i) {
    const int u = u0 + i % kTile;
    const int v = v0 + i / kTile;
    r[static_cast<std::size_t>(i)] = xray.at(u, v) - gain * drr.at(u, v) - offset;
  }
  for (int v = 0; v < kTile; ++v) {
    for (int u = 0; u < kTile; ++u) {
      const auto i = static_cast<std::size_t>(v * kTile + u);
      moments->variance += r[i] * r[i] / kPixels;
      if (u + 1 < kTile) moments->along_u += r[i] * r[i + 1] / (kTile * (kTile - 1));
      if (v + 1 < kTile) moments->along_v += r[i] * r[i + kTile] / (kTile * (kTile - 1));
    }
  }
}

double stretch(double correlation) {
  // Taking out gain and offset leaves white noise slightly anticorrelated; above 0.95 the estimate has no meaning.
  const double bounded = std::min(std::max(correlation, 0.0), 0.95);
  return (1.0 + bounded) / (1.0 - bounded);
}

}  // namespace

double residualCorrelationArea(const FloatImage& drr, const FloatImage& xray) {
  Moments moments;
  for (int v = 0; v + kTile <= drr.height; v += kTile) {
    for (int u = 0; u + kTile <= drr.width; u += kTile) {
      if (drr.at(u, v) > 0.0F && drr.at(u + kTile - 1, v + kTile - 1) > 0.0F) addTile(drr, xray, u, v, &moments);
    }
  }
  if (!(moments.variance > 0.0)) return 1.0;
  return stretch(moments.along_u / moments.variance) * stretch(moments.along_v / moments.variance);
}

}  // namespace xray_registration
