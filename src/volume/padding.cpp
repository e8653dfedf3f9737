#include "padding.h"

#include <algorithm>

namespace xray_registration {
namespace {

constexpr std::int16_t kAirHu = -1000;
// Below it padding is air already.
constexpr int kTissueHu = -500;
// The largest value of scanners that store 12 bits is 3071; above, and up to some 20000 HU with extended ranges, is
// metal alone, and none of it holds one value throughout.
constexpr int kBeyondTwelveBitsHu = 4000;
constexpr int kDenseHu = 2000;
constexpr double kEdgeShare = 0.9;  // Of the voxels along four edges.

}  // namespace

std::size_t clearPadding(int low, int high, int width, std::size_t rows, std::int16_t* hu) {
  if (high < kTissueHu) return 0;
  std::size_t cleared = 0;
  const auto clear = [low, high, &cleared](std::int16_t* voxel) {
    if (*voxel < low || *voxel > high) return false;
    *voxel = kAirHu;
    ++cleared;
    return true;
  };
  for (std::size_t row = 0; row < rows; ++row) {
    std::int16_t* const begin = hu + row * static_cast<std::size_t>(width);
    std::int16_t* const end = begin + width;
    if (low > kBeyondTwelveBitsHu) {
      std::for_each(begin, end, [&clear](std::int16_t& voxel) { clear(&voxel); });
      continue;
    }
    std::int16_t* first = begin;
    while (first != end && clear(first)) ++first;
    for (std::int16_t* last = end; last != first && clear(last - 1);) --last;
  }
  return cleared;
}

std::optional<std::int16_t> valueAtEdges(const std::vector<std::int16_t>& hu, const std::array<int, 3>& size) {
  const std::array<std::size_t, 3> n = {static_cast<std::size_t>(size[0]), static_cast<std::size_t>(size[1]),
                                        static_cast<std::size_t>(size[2])};
  const std::array<std::size_t, 3> stride = {1, n[0], n[0] * n[1]};
  for (std::size_t axis = 3; axis-- > 0;) {
    const std::size_t a = (axis + 1) % 3;
    const std::size_t b = (axis + 2) % 3;
    const std::array<std::size_t, 4> starts = {0, stride[a] * (n[a] - 1), stride[b] * (n[b] - 1),
                                               stride[a] * (n[a] - 1) + stride[b] * (n[b] - 1)};
    const std::int16_t value = hu[stride[axis] * (n[axis] / 2)];
    std::size_t same = 0;
    for (const std::size_t start : starts) {
      for (std::size_t i = 0; i < n[axis]; ++i) same += hu[start + stride[axis] * i] == value ? 1 : 0;
    }
    if (static_cast<double>(same) >= kEdgeShare * 4.0 * static_cast<double>(n[axis])) return value;
  }
  return std::nullopt;
}

std::optional<std::int16_t> densePaddingAtEdges(const std::vector<std::int16_t>& hu, const std::array<int, 3>& size) {
  const auto value = valueAtEdges(hu, size);
  return value && *value >= kDenseHu ? value : std::nullopt;
}

}  // namespace xray_registration
