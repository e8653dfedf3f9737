#include "registration/view_preparation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "xray_registration/image/image_pyramid.h"

namespace xray_registration {
namespace {

/// A window smaller than this share of the image is worth its copy.
constexpr double kWorthCropping = 0.6;
/// The solver's coarsest level needs a few tiles.
constexpr int kSmallestWindow = 64;
constexpr int kTile = 8;

struct Range {
  double low = 0.0;
  double high = 0.0;
};

/// Pixels between the two rays in a plane through an image axis that touch a sphere's outline: the tangents from the
/// source, ratio = (across · depth ± radius √(across² + depth² − radius²)) / (depth² − radius²).
Range outline(double focal, double principal, double across_mm, double depth_mm, double radius_mm) {
  const double radius2 = radius_mm * radius_mm;
  const double touching = radius_mm * std::sqrt(across_mm * across_mm + depth_mm * depth_mm - radius2);
  const double scale = focal / (depth_mm * depth_mm - radius2);
  return {principal + scale * (across_mm * depth_mm - touching), principal + scale * (across_mm * depth_mm + touching)};
}

struct Ranges {
  Range u;
  Range v;
};

constexpr double kEverywhere = 1e9;
constexpr Ranges kWhole{{-kEverywhere, kEverywhere}, {-kEverywhere, kEverywhere}};

Ranges shadowOfSphere(const XrayCamera& camera, const ShadowBounds& bounds) {
  const Eigen::Vector3d& centre = bounds.centre_mm;
  if (!(centre.z() > 1.2 * bounds.radius_mm)) return kWhole;
  return {outline(camera.fx, camera.cx, centre.x(), centre.z(), bounds.radius_mm),
          outline(camera.fy, camera.cy, centre.y(), centre.z(), bounds.radius_mm)};
}

/// A margin in every direction, so towards the source as well: it is largest at the nearest corner.
Ranges shadowOfBox(const XrayCamera& camera, const ShadowBounds& bounds) {
  if (bounds.corners_mm.empty()) return kWhole;
  Ranges ranges{{kEverywhere, -kEverywhere}, {kEverywhere, -kEverywhere}};
  double nearest_mm = kEverywhere;
  for (const Eigen::Vector3d& corner : bounds.corners_mm) {
    if (!(corner.z() > 2.0 * bounds.margin_mm + 1.0)) return kWhole;
    const Eigen::Vector2d pixel = camera.project(corner);
    ranges.u = {std::min(ranges.u.low, pixel.x()), std::max(ranges.u.high, pixel.x())};
    ranges.v = {std::min(ranges.v.low, pixel.y()), std::max(ranges.v.high, pixel.y())};
    nearest_mm = std::min(nearest_mm, corner.z());
  }
  const double margin = bounds.margin_mm / (nearest_mm - bounds.margin_mm);
  ranges.u = {ranges.u.low - margin * camera.fx, ranges.u.high + margin * camera.fx};
  ranges.v = {ranges.v.low - margin * camera.fy, ranges.v.high + margin * camera.fy};
  return ranges;
}

PixelWindow windowAround(const XrayCamera& camera, const ShadowBounds& bounds) {
  const PixelWindow whole{0, 0, camera.width, camera.height};
  const Ranges sphere = shadowOfSphere(camera, bounds);
  const Ranges box = shadowOfBox(camera, bounds);
  const auto clamped = [](double value, int limit) {
    return static_cast<int>(std::lround(std::min(std::max(value, 0.0), static_cast<double>(limit))));
  };
  PixelWindow window;
  window.x = clamped(std::floor(std::max(sphere.u.low, box.u.low)), camera.width);
  window.y = clamped(std::floor(std::max(sphere.v.low, box.v.low)), camera.height);
  window.width = clamped(std::ceil(std::min(sphere.u.high, box.u.high) + 1.0), camera.width) - window.x;
  window.height = clamped(std::ceil(std::min(sphere.v.high, box.v.high) + 1.0), camera.height) - window.y;
  const double share =
      static_cast<double>(window.width) * window.height / (static_cast<double>(camera.width) * camera.height);
  if (window.width < kSmallestWindow || window.height < kSmallestWindow || share > kWorthCropping) return whole;
  return window;
}

FloatImage cropped(const AttenuationImage& image, const PixelWindow& window) {
  FloatImage result(window.width, window.height);
  std::vector<float> buffer;
  for (int v = 0; v < window.height; ++v) {
    std::copy_n(image.row(v + window.y, window.x, window.width, &buffer), window.width, &result.at(0, v));
  }
  return result;
}

MaskImage cropped(const MaskImage& mask, const PixelWindow& window) {
  MaskImage result(window.width, window.height, 255);
  for (int v = 0; v < window.height && !mask.empty(); ++v) {
    std::copy_n(&mask.at(window.x, v + window.y), window.width, &result.at(0, v));
  }
  return result;
}

FloatImage weightsOf(const MaskImage& mask) {
  FloatImage weight(mask.width, mask.height);
  std::transform(mask.pixels.begin(), mask.pixels.end(), weight.pixels.begin(),
                 [](std::uint8_t allowed) { return allowed != 0 ? 1.0F : 0.0F; });
  return weight;
}

/// Values without weight become the mean of the others: the device sums differences from a pixel that may be one of
/// them, and metal or letters far off would cost the rest its digits.
void hideUnweighted(const FloatImage& weight, FloatImage* attenuation) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < weight.pixels.size(); ++i) {
    if (weight.pixels[i] == 0.0F) continue;
    sum += attenuation->pixels[i];
    count += 1.0;
  }
  const float mean = count > 0.0 ? static_cast<float>(sum / count) : 0.0F;
  for (std::size_t i = 0; i < weight.pixels.size(); ++i) {
    if (weight.pixels[i] == 0.0F) attenuation->pixels[i] = mean;
  }
}

}  // namespace

PreparedView prepareView(const XrayFrame& view, const ShadowBounds& bounds, int binning) {
  const PixelWindow window = windowAround(view.camera, bounds);
  PreparedView prepared;
  prepared.camera = view.camera.cropped(window.x, window.y, window.width, window.height);
  MaskImage mask;
  // At least a tile has to be left, however close the start pose puts the CT.
  binning = std::min(binning, std::min(window.width, window.height) / kTile);
  if (binning > 1) {
    binImage(view.attenuation, view.mask, window, binning, &prepared.attenuation, &mask);
    prepared.camera = prepared.camera.binned(binning);
  } else {
    prepared.attenuation = cropped(view.attenuation, window);
    mask = cropped(view.mask, window);
  }
  prepared.weight = weightsOf(mask);
  hideUnweighted(prepared.weight, &prepared.attenuation);
  return prepared;
}

}  // namespace xray_registration
