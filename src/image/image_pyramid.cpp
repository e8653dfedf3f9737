#include "xray_registration/image/image_pyramid.h"

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

/// Sums of one row of blocks.
struct BlockRow {
  std::vector<double> all;
  std::vector<double> allowed;
  std::vector<int> allowed_count;
};

void sumBlocks(const FloatImage& image, const MaskImage& mask, int factor, int row, BlockRow* sums) {
  const std::size_t blocks = sums->all.size();
  sums->all.assign(blocks, 0.0);
  sums->allowed.assign(blocks, 0.0);
  sums->allowed_count.assign(blocks, 0);
  for (int v = row * factor; v < (row + 1) * factor; ++v) {
    const float* pixel = &image.at(0, v);
    const std::uint8_t* allow = mask.empty() ? nullptr : &mask.at(0, v);
    for (std::size_t block = 0; block < blocks; ++block) {
      for (int i = 0; i < factor; ++i, ++pixel) {
        sums->all[block] += *pixel;
        if (allow == nullptr || *allow++ != 0) {
          sums->allowed[block] += *pixel;
          ++sums->allowed_count[block];
        }
      }
    }
  }
}

}  // namespace

void binImage(const FloatImage& image, const MaskImage& mask, int factor, FloatImage* binned, MaskImage* binned_mask) {
  check(image, mask, factor);
  FloatImage result(image.width / factor, image.height / factor);
  MaskImage result_mask(result.width, result.height);
  const int block_size = factor * factor;
  BlockRow sums;
  sums.all.resize(static_cast<std::size_t>(result.width));
  for (int v = 0; v < result.height; ++v) {
    sumBlocks(image, mask, factor, v, &sums);
    for (int u = 0; u < result.width; ++u) {
      const auto block = static_cast<std::size_t>(u);
      const int count = sums.allowed_count[block];
      const double mean = count > 0 ? sums.allowed[block] / count : sums.all[block] / block_size;
      result.at(u, v) = static_cast<float>(mean);
      result_mask.at(u, v) = 2 * count >= block_size ? kUse : 0;
    }
  }
  *binned = std::move(result);
  *binned_mask = std::move(result_mask);
}

}  // namespace xray_registration
