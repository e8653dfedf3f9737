#pragma once

#include <cmath>
#include <functional>

#include "xray_registration/volume/surface_mesh.h"

// Closed meshes of known shape, normals outwards.

namespace xray_registration {
namespace test_meshes {

/// A grid of `rows` × `columns` points that closes in both directions.
inline SurfaceMesh closedGrid(std::uint32_t rows, std::uint32_t columns,
                              const std::function<Eigen::Vector3d(double, double)>& point) {
  SurfaceMesh mesh;
  for (std::uint32_t i = 0; i < rows; ++i) {
    for (std::uint32_t j = 0; j < columns; ++j) {
      mesh.points_mm.push_back(point(2.0 * M_PI * i / rows, 2.0 * M_PI * j / columns).cast<float>());
      const std::uint32_t i1 = (i + 1) % rows;
      const std::uint32_t j1 = (j + 1) % columns;
      mesh.triangles.push_back({i * columns + j, i1 * columns + j, i1 * columns + j1});
      mesh.triangles.push_back({i * columns + j, i1 * columns + j1, i * columns + j1});
    }
  }
  return mesh;
}

/// Around z; the tube's centre runs on a circle.
inline SurfaceMesh torus(const Eigen::Vector3d& centre, double radius, double tube_radius) {
  return closedGrid(120, 60, [=](double around, double across) -> Eigen::Vector3d {
    const double r = radius + tube_radius * std::cos(across);
    return centre + Eigen::Vector3d(r * std::cos(around), r * std::sin(around), tube_radius * std::sin(across));
  });
}

inline SurfaceMesh box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  SurfaceMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    mesh.points_mm.push_back(Eigen::Vector3d((corner & 1) != 0 ? high.x() : low.x(),
                                             (corner & 2) != 0 ? high.y() : low.y(),
                                             (corner & 4) != 0 ? high.z() : low.z())
                                 .cast<float>());
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

inline SurfaceMesh sphere(const Eigen::Vector3d& centre, double radius) {
  constexpr std::uint32_t kRows = 60;
  constexpr std::uint32_t kColumns = 120;
  SurfaceMesh mesh;
  const auto ring = [&](std::uint32_t row, std::uint32_t column) {
    return 2 + (row - 1) * kColumns + column % kColumns;
  };
  mesh.points_mm.push_back((centre + Eigen::Vector3d(0.0, 0.0, radius)).cast<float>());
  mesh.points_mm.push_back((centre - Eigen::Vector3d(0.0, 0.0, radius)).cast<float>());
  for (std::uint32_t row = 1; row < kRows; ++row) {
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      const double polar = M_PI * row / kRows;
      const double around = 2.0 * M_PI * column / kColumns;
      mesh.points_mm.push_back((centre + radius * Eigen::Vector3d(std::sin(polar) * std::cos(around),
                                                                  std::sin(polar) * std::sin(around), std::cos(polar)))
                                   .cast<float>());
      if (row == 1) mesh.triangles.push_back({0, ring(1, column), ring(1, column + 1)});
      if (row == kRows - 1) mesh.triangles.push_back({1, ring(row, column + 1), ring(row, column)});
      if (row == kRows - 1) continue;
      mesh.triangles.push_back({ring(row, column), ring(row + 1, column), ring(row + 1, column + 1)});
      mesh.triangles.push_back({ring(row, column), ring(row + 1, column + 1), ring(row, column + 1)});
    }
  }
  return mesh;
}

inline SurfaceMesh flipped(SurfaceMesh mesh) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

/// Both in one mesh.
inline SurfaceMesh joined(SurfaceMesh a, const SurfaceMesh& b) {
  const auto offset = static_cast<std::uint32_t>(a.points_mm.size());
  a.points_mm.insert(a.points_mm.end(), b.points_mm.begin(), b.points_mm.end());
  for (const auto& t : b.triangles) a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  return a;
}

}  // namespace test_meshes
}  // namespace xray_registration
