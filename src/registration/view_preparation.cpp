#include "registration/view_preparation.h"

#include <algorithm>
#include <cmath>

#include "xray_registration/image/image_pyramid.h"

namespace xray_registration {
namespace {

struct Window {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

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

Window windowAround(const XrayCamera& camera, const Eigen::Vector3d& centre_mm, double radius_mm) {
  const Window whole{0, 0, camera.width, camera.height};
  if (!(centre_mm.z() > 1.2 * radius_mm)) return whole;
  const Range u = outline(camera.fx, camera.cx, centre_mm.x(), centre_mm.z(), radius_mm);
  const Range v = outline(camera.fy, camera.cy, centre_mm.y(), centre_mm.z(), radius_mm);
  const auto clamped = [](double value, int limit) {
    return static_cast<int>(std::lround(std::min(std::max(value, 0.0), static_cast<double>(limit))));
  };
  Window window;
  window.x = clamped(std::floor(u.low), camera.width);
  window.y = clamped(std::floor(v.low), camera.height);
  window.width = clamped(std::ceil(u.high + 1.0), camera.width) - window.x;
  window.height = clamped(std::ceil(v.high + 1.0), camera.height) - window.y;
  const double share =
      static_cast<double>(window.width) * window.height / (static_cast<double>(camera.width) * camera.height);
  if (window.width < kSmallestWindow || window.height < kSmallestWindow || share > kWorthCropping) return whole;
  return window;
}

template <typename T>
Image<T> cropped(const Image<T>& image, const Window& window) {
  Image<T> result(window.width, window.height);
  for (int v = 0; v < window.height; ++v) {
    const auto row = image.pixels.begin() + static_cast<std::ptrdiff_t>(v + window.y) * image.width + window.x;
    std::copy(row, row + window.width, result.pixels.begin() + static_cast<std::ptrdiff_t>(v) * window.width);
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

PreparedView prepareView(const XrayFrame& view, const Eigen::Vector3d& centre_camera_mm, double radius_mm,
                         int binning) {
  const Window window = windowAround(view.camera, centre_camera_mm, radius_mm);
  const bool whole = window.width == view.camera.width && window.height == view.camera.height;
  PreparedView prepared;
  prepared.camera = whole ? view.camera : view.camera.cropped(window.x, window.y, window.width, window.height);
  prepared.attenuation = whole ? view.attenuation : cropped(view.attenuation, window);
  MaskImage mask =
      view.mask.empty() ? MaskImage(window.width, window.height, 1) : (whole ? view.mask : cropped(view.mask, window));
  // At least a tile has to be left, however close the start pose puts the CT.
  binning = std::min(binning, std::min(window.width, window.height) / kTile);
  if (binning > 1) {
    FloatImage binned;
    MaskImage binned_mask;
    binImage(prepared.attenuation, mask, binning, &binned, &binned_mask);
    prepared.camera = prepared.camera.binned(binning);
    prepared.attenuation = std::move(binned);
    mask = std::move(binned_mask);
  }
  prepared.weight = weightsOf(mask);
  hideUnweighted(prepared.weight, &prepared.attenuation);
  return prepared;
}

}  // namespace xray_registration
