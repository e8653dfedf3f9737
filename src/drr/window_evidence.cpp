#include "xray_registration/drr/window_evidence.h"

#include <algorithm>
#include <cmath>

#include "xray_registration/drr/tile_shape.h"

namespace xray_registration {
namespace {

constexpr int kMostVectors = 3 + kMostRayMotions;
using Products = WindowCovariance;

/// Adds a tile's products to a window's. The tile's are relative to its own values of DRR and X-ray, which lie `shift`
/// above the window's: with L = I + shift e₀ᵀ in the rows of DRR and X-ray the window gains L P Lᵀ.
void addTile(const float* tile, const double (&shift)[2], Products* sums) {
  const auto count = sums->rows();
  Products own(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = i; j < count; ++j) own(i, j) = own(j, i) = *tile++;
  }
  for (int i = 1; i <= 2; ++i) {
    own.row(i) += shift[i - 1] * own.row(0);
    own.col(i) += shift[i - 1] * own.col(0);
  }
  *sums += own;
}

/// A window's products, relative to the values of its first tile.
Products windowProducts(const TileProducts& products, int x, int y, int span_x, int span_y) {
  Products sums = Products::Zero(products.vectors, products.vectors);
  const float* reference = products.tile(x, y) + products.pairs();
  for (int row = y; row < y + span_y; ++row) {
    for (int column = x; column < x + span_x; ++column) {
      const float* tile = products.tile(column, row);
      const float* values = tile + products.pairs();
      addTile(tile, {static_cast<double>(values[0]) - reference[0], static_cast<double>(values[1]) - reference[1]},
              &sums);
    }
  }
  return sums;
}

/// Pixels of a window, before anything else is added up: most windows of a small body hold none.
double pixelsOf(const TileProducts& products, int x, int y, int span_x, int span_y) {
  double pixels = 0.0;
  for (int row = y; row < y + span_y; ++row) {
    for (int column = x; column < x + span_x; ++column) pixels += products.tile(column, row)[0];
  }
  return pixels;
}

Products covarianceOf(const Products& sums) {
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostVectors, 1> mean = sums.col(0) / sums(0, 0);
  return sums / sums(0, 0) - mean * mean.transpose();
}

WindowEvidence evidenceOf(const Products& sums, const WindowOptions& options) {
  WindowEvidence window;
  window.pixels = sums(0, 0);
  const Products covariance = covarianceOf(sums);
  const Eigen::Index motions = covariance.rows() - 3;
  const double var_v = std::max(covariance(1, 1), 0.0);
  const double var_x = std::max(covariance(2, 2), 0.0);
  const double inv_v2 = 1.0 / (var_v + options.epsilon_value * options.epsilon_value);
  const double inv_vx = std::sqrt(inv_v2 / (var_x + options.epsilon_xray * options.epsilon_xray));
  window.content = var_v * inv_v2;
  window.importance = window.pixels * var_x / (var_x + options.contrast * options.contrast);
  window.correlation = covariance(1, 2) * inv_vx;
  const double error = 1.0 - window.correlation;
  const double shrink = options.robust_scale2 / (error + options.robust_scale2);
  window.cost = window.importance * error * shrink;
  const double slope = window.importance * shrink * shrink;
  const auto by_value = covariance.col(1).tail(motions);
  const auto by_xray = covariance.col(2).tail(motions);
  window.gradient = -slope * inv_vx * (by_xray - covariance(1, 2) * inv_v2 * by_value);
  const double curvature = slope * inv_v2 * std::clamp(window.correlation, 0.1, 1.0);
  window.matrix = curvature * (covariance.bottomRightCorner(motions, motions) -
                               inv_v2 * (2.0 - var_v * inv_v2) * by_value * by_value.transpose());
  return window;
}

}  // namespace

void forEachWindowCovariance(const TileProducts& products, int span,
                             const std::function<void(double pixels, const WindowCovariance& covariance)>& look) {
  const WindowGrid grid(products.tiles_x, products.tiles_y, span);
  for (int y = 0; y < grid.windows_y; ++y) {
    for (int x = 0; x < grid.windows_x; ++x) {
      if (!(pixelsOf(products, x, y, grid.span_x, grid.span_y) >= grid.min_weight)) continue;
      const Products sums = windowProducts(products, x, y, grid.span_x, grid.span_y);
      look(sums(0, 0), covarianceOf(sums));
    }
  }
}

void forEachWindow(const TileProducts& products, const WindowOptions& options,
                   const std::function<void(const WindowEvidence&)>& look) {
  const WindowGrid grid(products.tiles_x, products.tiles_y, options.span);
  for (int y = 0; y < grid.windows_y; ++y) {
    for (int x = 0; x < grid.windows_x; ++x) {
      if (!(pixelsOf(products, x, y, grid.span_x, grid.span_y) >= grid.min_weight)) continue;
      const Products sums = windowProducts(products, x, y, grid.span_x, grid.span_y);
      WindowEvidence window = evidenceOf(sums, options);
      window.x = x;
      window.y = y;
      look(window);
    }
  }
}

}  // namespace xray_registration
