#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace xray_registration {

/// A single-channel image, row by row without padding.
template <typename T>
struct Image {
  int width = 0;
  int height = 0;
  std::vector<T> pixels;

  Image() = default;
  Image(int image_width, int image_height, T value = T{})
      : width(image_width),
        height(image_height),
        pixels(static_cast<std::size_t>(image_width) * static_cast<std::size_t>(image_height), value) {}

  T& at(int u, int v) { return pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + u]; }
  const T& at(int u, int v) const { return pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + u]; }
  bool empty() const { return pixels.empty(); }
};

using FloatImage = Image<float>;
using CountImage = Image<std::uint16_t>;
/// 0 = leave the pixel out; anything else = use it.
using MaskImage = Image<std::uint8_t>;

/// Part of an image, pixels.
struct PixelWindow {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

}  // namespace xray_registration
