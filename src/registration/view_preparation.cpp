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

Window windowAround(const XrayCamera& camera, const Eigen::Vector3d& centre_mm, double radius_mm) {
  const Window whole{0, 0, camera.width, camera.height};
  if (!(centre_mm.z() > 1.2 * radius_mm)) return whole;
  const Eigen::Vector2d middle = camera.project(centre_mm);
  // A sphere's outline is a little wider than its radius at its centre's depth.
  const double shrink = std::sqrt(1.0 - std::pow(radius_mm / centre_mm.z(), 2));
  const double half_u = camera.fx * radius_mm / centre_mm.z() / shrink;
  const double half_v = camera.fy * radius_mm / centre_mm.z() / shrink;
  const auto clamped = [](double value, int limit) {
    return static_cast<int>(std::lround(std::min(std::max(value, 0.0), static_cast<double>(limit))));
  };
  Window window;
  window.x = clamped(std::floor(middle.x() - half_u), camera.width);
  window.y = clamped(std::floor(middle.y() - half_v), camera.height);
  window.width = clamped(std::ceil(middle.x() + half_u), camera.width) - window.x;
  window.height = clamped(std::ceil(middle.y() + half_v), camera.height) - window.y;
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

}  // namespace

PreparedView prepareView(const ViewInput& view, const Eigen::Vector3d& centre_camera_mm, double radius_mm,
                         int binning) {
  const Window window = windowAround(view.camera, centre_camera_mm, radius_mm);
  const bool whole = window.width == view.camera.width && window.height == view.camera.height;
  PreparedView prepared;
  prepared.camera = whole ? view.camera : view.camera.cropped(window.x, window.y, window.width, window.height);
  prepared.attenuation = whole ? view.attenuation : cropped(view.attenuation, window);
  MaskImage mask =
      view.mask.empty() ? MaskImage(window.width, window.height, 1) : (whole ? view.mask : cropped(view.mask, window));
  if (binning > 1) {
    FloatImage binned;
    MaskImage binned_mask;
    binImage(prepared.attenuation, mask, binning, &binned, &binned_mask);
    prepared.camera = prepared.camera.binned(binning);
    prepared.attenuation = std::move(binned);
    mask = std::move(binned_mask);
  }
  prepared.weight = weightsOf(mask);
  return prepared;
}

}  // namespace xray_registration
