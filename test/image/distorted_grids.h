#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "xray_registration/image/image.h"
#include "xray_registration/image/undistortion_map.h"

// Pictures of regular grids by a detector whose distortion is known.

namespace xray_registration {
namespace distorted {

/// What an image intensifier does: it magnifies towards the rim (pincushion) and turns by an angle that grows with the
/// distance from the middle (S-shape). Neither is a polynomial of the form that is fitted.
struct Detector {
  int width = 400;
  int height = 400;
  double twist_px = 0.0;       ///< Sideways at a distance of half the width.
  double pincushion_px = 0.0;  ///< Outwards there.

  Eigen::Vector2d middle() const { return {0.5 * (width - 1), 0.5 * (height - 1)}; }

  Eigen::Vector2d straightOf(const Eigen::Vector2d& raw) const {
    const double half = 0.5 * width;
    const Eigen::Vector2d offset = raw - middle();
    const double share = offset.squaredNorm() / (half * half);
    const Eigen::Rotation2Dd turned(-share * twist_px / half);
    return middle() + (1.0 - share * pincushion_px / half) * (turned * offset);
  }

  Eigen::Vector2d rawOf(const Eigen::Vector2d& straight) const {
    Eigen::Vector2d raw = straight;
    for (int i = 0; i < 100; ++i) raw += straight - straightOf(raw);
    return raw;
  }
};

/// A regular grid on the detector's face, and what is seen of it.
struct Grid {
  enum class Shape { kBeads, kHoles, kMesh };
  Shape shape = Shape::kBeads;
  bool hexagonal = false;
  double pitch_px = 16.0;
  double stretch = 1.0;  ///< Of the second axis; 1 for a regular grid.
  double angle_rad = 0.0;
  Eigen::Vector2d offset_px = Eigen::Vector2d(3.0, -2.0);  ///< Of a mark from the middle.
  double missing_share = 0.0;
  double field_radius_px = 0.0;  ///< Round collimator; 0 = open.
  double shading = 0.0;          ///< How much darker the left side is than the right.
  double noise = 0.0;            ///< Of an open beam of 1000.

  /// Columns: from a mark to its neighbours.
  Eigen::Matrix2d steps() const {
    const double angle = hexagonal ? std::acos(0.5) : std::acos(0.0);
    Eigen::Matrix2d axes;
    axes << 1.0, std::cos(angle) * stretch, 0.0, std::sin(angle) * stretch;
    return pitch_px * (Eigen::Rotation2Dd(angle_rad).toRotationMatrix() * axes);
  }

  /// The same for the same cell.
  bool isThere(const Eigen::Vector2i& cell) const {
    // Two rounds of a linear congruential generator are random enough for holes in a grid.
    auto state = static_cast<std::uint32_t>(7919 * cell.x() + 104729 * cell.y() + 12345);
    for (int i = 0; i < 2; ++i) state = (state ^ (state >> 15)) * 2246822519U;
    return static_cast<double>(state >> 8) / (1 << 24) >= missing_share;
  }
};

inline Eigen::Vector2i roundedCell(const Eigen::Vector2d& cell) {
  return {static_cast<int>(std::lround(cell.x())), static_cast<int>(std::lround(cell.y()))};
}

/// Share of the beam that comes through at a place of the plate, in pixels of the straight picture from the middle.
inline double transmissionAt(const Grid& grid, const Eigen::Vector2d& place) {
  const Eigen::Matrix2d steps = grid.steps();
  const Eigen::Vector2d cell = steps.inverse() * (place - grid.offset_px);
  const Eigen::Vector2i nearest = roundedCell(cell);
  const auto softly = [](double inside_px) { return 1.0 / (1.0 + std::exp(-2.5 * inside_px)); };
  if (grid.shape == Grid::Shape::kMesh) {
    // Wires run through the marks' places; what is bright lies between them.
    const Eigen::Vector2d from_wire = (cell - nearest.cast<double>()).cwiseAbs() * grid.pitch_px;
    const double wire = 0.08 * grid.pitch_px;
    return (1.0 - 0.6 * softly(wire - from_wire.x())) * (1.0 - 0.6 * softly(wire - from_wire.y()));
  }
  // The nearest cell by rounding is not always the nearest mark of a hexagonal grid, but is as far as a mark reaches.
  const double distance = (place - grid.offset_px - steps * nearest.cast<double>()).norm();
  const double mark = grid.isThere(nearest) ? softly(0.27 * grid.pitch_px - distance) : 0.0;
  return grid.shape == Grid::Shape::kBeads ? 1.0 - 0.7 * mark : 0.35 + 0.6 * mark;
}

/// The picture, intensities; each pixel is a mean over 3 × 3 places.
inline FloatImage pictureOf(const Grid& grid, const Detector& detector, unsigned seed = 1) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  FloatImage picture(detector.width, detector.height);
  for (int v = 0; v < detector.height; ++v) {
    for (int u = 0; u < detector.width; ++u) {
      const Eigen::Vector2d raw(u, v);
      double sum = 0.0;
      for (int i = 0; i < 9; ++i) {
        const Eigen::Vector2d part((i % 3 - 1) / 3.0, (i / 3 - 1) / 3.0);
        sum += transmissionAt(grid, detector.straightOf(raw + part) - detector.middle()) / 9.0;
      }
      const bool open = grid.field_radius_px <= 0.0 || (raw - detector.middle()).norm() < grid.field_radius_px;
      const double beam = open ? 1000.0 * (1.0 - grid.shading * (1.0 - static_cast<double>(u) / detector.width)) : 4.0;
      picture.at(u, v) = static_cast<float>(std::max(0.0, beam * sum + grid.noise * normal(random)));
    }
  }
  return picture;
}

/// The marks that lie in the picture and the field with their surroundings.
inline std::vector<PixelPair> marksOf(const Grid& grid, const Detector& detector) {
  const double radius = grid.field_radius_px > 0.0 ? grid.field_radius_px : 1e9;
  const double rim = 0.8 * grid.pitch_px;
  const int reach = static_cast<int>(2.0 * (detector.width + detector.height) / grid.pitch_px);
  std::vector<PixelPair> marks;
  for (int i = -reach; i <= reach; ++i) {
    for (int j = -reach; j <= reach; ++j) {
      const Eigen::Vector2d straight = detector.middle() + grid.offset_px + grid.steps() * Eigen::Vector2d(i, j);
      // Far outside the distortion folds the plane over.
      if ((straight - detector.middle()).norm() > detector.width || !grid.isThere({i, j})) continue;
      const Eigen::Vector2d raw = detector.rawOf(straight);
      const bool inside = raw.x() > rim && raw.y() > rim && raw.x() < detector.width - 1 - rim &&
                          raw.y() < detector.height - 1 - rim && (raw - detector.middle()).norm() < radius - rim;
      if (inside) marks.push_back({raw, straight});
    }
  }
  return marks;
}

}  // namespace distorted
}  // namespace xray_registration
