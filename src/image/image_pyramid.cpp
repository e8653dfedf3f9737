#include "xray_registration/image/image_pyramid.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

namespace xray_registration {
namespace {

constexpr std::uint8_t kUse = 255;

void check(const FloatImage& image, const MaskImage& mask, int factor) {
  if (factor < 1) throw std::invalid_argument("the binning factor is " + std::to_string(factor) + ", it must be ≥ 1");
  if (mask.empty() || (mask.width == image.width && mask.height == image.height)) return;
  throw std::invalid_argument("the mask has " + std::to_string(mask.width) + " × " + std::to_string(mask.height) +
                              " pixels, its image " + std::to_string(image.width) + " × " +
                              std::to_string(image.height));
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

void binRows(const FloatImage& image, const MaskImage& mask, int factor, FloatImage* binned, MaskImage* binned_mask) {
  const auto block_size = static_cast<float>(factor * factor);
  const std::vector<std::uint8_t> everywhere(static_cast<std::size_t>(image.width), kUse);
  Columns columns(image.width);
  for (int v = 0; v < binned->height; ++v) {
    columns.begin();
    for (int row = v * factor; row < (v + 1) * factor; ++row) {
      columns.add(&image.at(0, row), mask.empty() ? everywhere.data() : &mask.at(0, row));
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

void binImage(const FloatImage& image, const MaskImage& mask, int factor, FloatImage* binned, MaskImage* binned_mask) {
  check(image, mask, factor);
  FloatImage result(image.width / factor, image.height / factor);
  MaskImage result_mask(result.width, result.height);
  binRows(image, mask, factor, &result, &result_mask);
  *binned = std::move(result);
  *binned_mask = std::move(result_mask);
}

}  // namespace xray_registration
