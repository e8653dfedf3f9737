#include "xray_registration/drr/window_evidence.h"

#include <algorithm>
#include <cmath>

#include "xray_registration/drr/tile_shape.h"

namespace xray_registration {
namespace {

/// A window's sums as a symmetric matrix over the vectors, relative to one pair of values.
class WindowSums {
 public:
  WindowSums(const TileProducts& products, int x, int y, int span_x, int span_y)
      : sums_(Eigen::MatrixXd::Zero(products.vectors, products.vectors)),
        value_(products.tile(x, y)[products.pairs()]),
        xray_(products.tile(x, y)[products.pairs() + 1]) {
    for (int row = y; row < y + span_y; ++row) {
      for (int column = x; column < x + span_x; ++column) add(products, products.tile(column, row));
    }
  }

  double pixels() const { return sums_(0, 0); }
  /// Weighted covariances of the vectors.
  Eigen::MatrixXd covariances() const {
    const Eigen::VectorXd mean = sums_.row(0) / pixels();
    return sums_ / pixels() - mean * mean.transpose();
  }

 private:
  /// A tile is relative to its own values: to (1, D + dv, I + dx, …) its products are carried by L P Lᵀ.
  void add(const TileProducts& products, const float* tile) {
    Eigen::MatrixXd own(products.vectors, products.vectors);
    for (int i = 0, pair = 0; i < products.vectors; ++i) {
      for (int j = i; j < products.vectors; ++j, ++pair) own(i, j) = own(j, i) = tile[pair];
    }
    const double shifts[2] = {tile[products.pairs()] - value_, tile[products.pairs() + 1] - xray_};
    for (int i = 1; i <= 2; ++i) {
      own.row(i) += shifts[i - 1] * own.row(0);
      own.col(i) += shifts[i - 1] * own.col(0);
    }
    sums_ += own;
  }

  Eigen::MatrixXd sums_;
  double value_, xray_;
};

WindowEvidence evidenceOf(const WindowSums& sums, const WindowOptions& options) {
  const Eigen::MatrixXd covariance = sums.covariances();
  const Eigen::Index motions = covariance.rows() - 3;
  const double var_v = std::max(covariance(1, 1), 0.0);
  const double var_x = std::max(covariance(2, 2), 0.0);
  const double inv_v2 = 1.0 / (var_v + options.epsilon_value * options.epsilon_value);
  const double inv_vx = std::sqrt(inv_v2 / (var_x + options.epsilon_xray * options.epsilon_xray));
  WindowEvidence window;
  window.pixels = sums.pixels();
  window.content = var_v * inv_v2;
  window.importance = sums.pixels() * var_x / (var_x + options.contrast * options.contrast);
  window.correlation = covariance(1, 2) * inv_vx;
  const double error = 1.0 - window.correlation;
  const double shrink = options.robust_scale2 / (error + options.robust_scale2);
  window.cost = window.importance * error * shrink;
  const double slope = window.importance * shrink * shrink;
  const auto by_value = covariance.row(1).tail(motions);
  const auto by_xray = covariance.row(2).tail(motions);
  window.gradient = -slope * inv_vx * (by_xray - covariance(1, 2) * inv_v2 * by_value).transpose();
  const double curvature = slope * inv_v2 * std::clamp(window.correlation, 0.1, 1.0);
  window.matrix = curvature * (covariance.bottomRightCorner(motions, motions) -
                               by_value.transpose() * by_value * inv_v2 * (2.0 - var_v * inv_v2));
  return window;
}

}  // namespace

std::vector<WindowEvidence> windowEvidence(const TileProducts& products, const WindowOptions& options) {
  const WindowGrid grid(products.tiles_x, products.tiles_y, options.span);
  std::vector<WindowEvidence> windows;
  for (int y = 0; y < grid.windows_y; ++y) {
    for (int x = 0; x < grid.windows_x; ++x) {
      const WindowSums sums(products, x, y, grid.span_x, grid.span_y);
      if (!(sums.pixels() >= grid.min_weight)) continue;
      windows.push_back(evidenceOf(sums, options));
      windows.back().x = x;
      windows.back().y = y;
    }
  }
  return windows;
}

}  // namespace xray_registration
