#include "xray_registration/image/image_pyramid.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "xray_registration/common/parallel.h"

namespace xray_registration {
namespace {

constexpr std::uint8_t kUse = 255;

void check(const AttenuationImage& image, const MaskImage& mask, const PixelWindow& window, int factor) {
  if (factor < 1) throw std::invalid_argument("the binning factor is " + std::to_string(factor) + ", it must be ≥ 1");
  if (window.x < 0 || window.y < 0 || window.width < 0 || window.height < 0 ||
      window.x + window.width > image.width() || window.y + window.height > image.height()) {
    throw std::invalid_argument("the window to bin is not inside the image");
  }
  if (mask.empty() || (mask.width == image.width() && mask.height == image.height())) return;
  throw std::invalid_argument("the mask has " + std::to_string(mask.width) + " × " + std::to_string(mask.height) +
                              " pixels, its image " + std::to_string(image.width()) + " × " +
                              std::to_string(image.height()));
}

/// Sums over the rows of a row of blocks, for each column.
struct Columns {
  explicit Columns(int width) : all(static_cast<std::size_t>(width)), allowed(all.size()), allowed_count(all.size()) {}

  void begin() {
    std::fill(all.begin(), all.end(), 0.0F);
    std::fill(allowed.begin(), allowed.end(), 0.0F);
    std::fill(allowed_count.begin(), allowed_count.end(), 0.0F);
  }

  // Without branches, for vector instructions.
  void add(const float* pixels, const std::uint8_t* mask) {
    const std::size_t count = all.size();
    for (std::size_t u = 0; u < count; ++u) {
      const float weight = mask[u] != 0 ? 1.0F : 0.0F;
      all[u] += pixels[u];
      allowed[u] += weight * pixels[u];
      allowed_count[u] += weight;
    }
  }

  std::vector<float> all, allowed, allowed_count;
};

float sumOf(const std::vector<float>& values, int first, int count) {
  const float* value = values.data() + first;
  float sum = 0.0F;
  for (int i = 0; i < count; ++i) sum += value[i];
  return sum;
}

/// What is binned, and how.
struct Binning {
  const AttenuationImage& image;
  const MaskImage& mask;
  const PixelWindow& window;
  int factor;
};

/// Bins the rows of blocks from `begin` to `end`.
void binRows(const Binning& from, int begin, int end, FloatImage* binned, MaskImage* binned_mask) {
  const int factor = from.factor;
  const auto block_size = static_cast<float>(factor * factor);
  const std::vector<std::uint8_t> everywhere(static_cast<std::size_t>(from.window.width), kUse);
  std::vector<float> buffer;
  Columns columns(from.window.width);
  for (int v = begin; v < end; ++v) {
    columns.begin();
    for (int row = from.window.y + v * factor; row < from.window.y + (v + 1) * factor; ++row) {
      columns.add(from.image.row(row, from.window.x, from.window.width, &buffer),
                  from.mask.empty() ? everywhere.data() : &from.mask.at(from.window.x, row));
    }
    for (int u = 0; u < binned->width; ++u) {
      const float count = sumOf(columns.allowed_count, u * factor, factor);
      binned->at(u, v) = count > 0.0F ? sumOf(columns.allowed, u * factor, factor) / count
                                      : sumOf(columns.all, u * factor, factor) / block_size;
      binned_mask->at(u, v) = 2.0F * count >= block_size ? kUse : 0;
    }
  }
}

}  // namespace

void binImage(const AttenuationImage& image, const MaskImage& mask, int factor, FloatImage* binned,
              MaskImage* binned_mask) {
  binImage(image, mask, {0, 0, image.width(), image.height()}, factor, binned, binned_mask);
}

void binImage(const AttenuationImage& image, const MaskImage& mask, const PixelWindow& window, int factor,
              FloatImage* binned, MaskImage* binned_mask) {
  check(image, mask, window, factor);
  FloatImage result(window.width / factor, window.height / factor);
  MaskImage result_mask(result.width, result.height);
  // About as many pixels for each thread as stay in its cache.
  constexpr int kPixelsAtOnce = 65536;
  const int rows = std::max(1, kPixelsAtOnce / std::max(1, window.width * factor));
  parallelFor((result.height + rows - 1) / rows, [&](int begin, int end) {
    binRows({image, mask, window, factor}, begin * rows, std::min(end * rows, result.height), &result, &result_mask);
  });
  *binned = std::move(result);
  *binned_mask = std::move(result_mask);
}

XrayFrame binned(const XrayFrame& frame, int factor) {
  XrayFrame small;
  small.camera = frame.camera.binned(factor);
  FloatImage attenuation;
  binImage(frame.attenuation, frame.mask, factor, &attenuation, &small.mask);
  small.attenuation = std::move(attenuation);
  return small;
}

}  // namespace xray_registration
