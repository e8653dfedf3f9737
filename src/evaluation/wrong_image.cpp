#include "evaluation/wrong_image.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace xray_registration {
namespace {

float interpolated(const FloatImage& image, const Eigen::Vector2d& pixel) {
  const double u = std::clamp(pixel.x(), 0.0, image.width - 1.0);
  const double v = std::clamp(pixel.y(), 0.0, image.height - 1.0);
  const int u0 = static_cast<int>(u);
  const int v0 = static_cast<int>(v);
  const int u1 = std::min(u0 + 1, image.width - 1);
  const int v1 = std::min(v0 + 1, image.height - 1);
  const double a = u - u0;
  const double b = v - v0;
  const double above = (1.0 - a) * image.at(u0, v0) + a * image.at(u1, v0);
  const double below = (1.0 - a) * image.at(u0, v1) + a * image.at(u1, v1);
  return static_cast<float>((1.0 - b) * above + b * below);
}

/// @param source  Pixel of the result → where in the image it comes from.
template <typename Source>
FloatImage warped(const FloatImage& image, const Source& source) {
  FloatImage result(image.width, image.height);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) result.at(u, v) = interpolated(image, source(Eigen::Vector2d(u, v)));
  }
  return result;
}

/// Solves r (1 + k1 r²) = distorted for r by Newton's method.
double straightRadius(double distorted, double k1) {
  constexpr int kEnough = 20;  // Converges quadratically from a start that is a few percent off.
  constexpr double kFolded = 0.1;
  double radius = distorted;
  for (int i = 0; i < kEnough; ++i) {
    const double slope = 1.0 + 3.0 * k1 * radius * radius;
    if (slope < kFolded) throw std::invalid_argument("such a k1 folds the image");
    radius -= (radius * (1.0 + k1 * radius * radius) - distorted) / slope;
  }
  return radius;
}

}  // namespace

FloatImage mirroredLeftRight(const FloatImage& image) {
  FloatImage result = image;
  for (int v = 0; v < image.height; ++v) std::reverse(&result.at(0, v), &result.at(0, v) + image.width);
  return result;
}

FloatImage mirroredUpDown(const FloatImage& image) {
  FloatImage result(image.width, image.height);
  for (int v = 0; v < image.height; ++v) std::copy_n(&image.at(0, v), image.width, &result.at(0, image.height - 1 - v));
  return result;
}

FloatImage turned(const FloatImage& image, int quarters) {
  FloatImage result = image;
  for (int i = 0; i < quarters; ++i) {
    FloatImage next(result.height, result.width);
    for (int v = 0; v < result.height; ++v) {
      for (int u = 0; u < result.width; ++u) next.at(result.height - 1 - v, u) = result.at(u, v);
    }
    result = std::move(next);
  }
  return result;
}

FloatImage inverted(const FloatImage& image) {
  FloatImage result = image;
  if (image.empty()) return result;
  const auto [smallest, largest] = std::minmax_element(image.pixels.begin(), image.pixels.end());
  for (float& value : result.pixels) value = *largest - (value - *smallest);
  return result;
}

FloatImage radiallyDistorted(const FloatImage& image, const XrayCamera& camera, double k1) {
  return warped(image, [&](const Eigen::Vector2d& pixel) {
    const Eigen::Vector3d ray = camera.rayDirection(pixel.x(), pixel.y());
    const double radius = ray.head<2>().norm();
    if (radius == 0.0) return pixel;
    const double shorter = straightRadius(radius, k1) / radius;
    return camera.project(Eigen::Vector3d(shorter * ray.x(), shorter * ray.y(), 1.0));
  });
}

FloatImage sShaped(const FloatImage& image, double edge_px) {
  const Eigen::Vector2d centre(0.5 * (image.width - 1), 0.5 * (image.height - 1));
  const double edge_radius = 0.5 * image.width;
  return warped(image, [&](const Eigen::Vector2d& pixel) {
    const Eigen::Vector2d from_centre = pixel - centre;
    const double angle = edge_px / edge_radius * from_centre.squaredNorm() / (edge_radius * edge_radius);
    // Turning keeps the radius, so the way back is the same angle the other way round.
    return (centre + Eigen::Rotation2Dd(-angle) * from_centre).eval();
  });
}

}  // namespace xray_registration
