#pragma once

#include <cstddef>
#include <vector>

namespace xray_registration {

/// What a march with ray motions adds up: per tile of an X-ray's level the weighted sums of products of all pairs of
/// its vectors (1, DRR, X-ray, the DRR's derivative by each motion), DRR and X-ray relative to the tile's own values.
struct TileProducts {
  int tiles_x = 0;
  int tiles_y = 0;
  int vectors = 3;          ///< 3 and the motions.
  std::vector<float> sums;  ///< Per tile: pairs (0,0) (0,1) … (1,1) …, then the two values.

  int pairs() const { return vectors * (vectors + 1) / 2; }
  int stride() const { return pairs() + 2; }
  /// Of one tile; x, y inside the grid.
  const float* tile(int x, int y) const {
    return sums.data() + static_cast<std::size_t>(y * tiles_x + x) * static_cast<std::size_t>(stride());
  }
};

}  // namespace xray_registration
