#pragma once

#include <algorithm>

namespace xray_registration {

/// Pixels along a tile's side.
constexpr int kTilePixels = 8;

/// How windows of `span` × `span` tiles lie over an X-ray's tiles, one starting at every tile.
struct WindowGrid {
  WindowGrid(int tiles_x, int tiles_y, int span)
      // A window never has more tiles than the image; span 0 is one window of everything.
      : span_x(span == 0 ? tiles_x : std::min(span, tiles_x)),
        span_y(span == 0 ? tiles_y : std::min(span, tiles_y)),
        windows_x(tiles_x - span_x + 1),
        windows_y(tiles_y - span_y + 1),
        // A window with less than a quarter of its pixels has no reliable mean.
        min_weight(span == 0 ? 64.0F : 0.25F * static_cast<float>(span_x * span_y * kTilePixels * kTilePixels)) {}
  int windows() const { return windows_x * windows_y; }

  int span_x, span_y, windows_x, windows_y;
  float min_weight;
};

}  // namespace xray_registration
