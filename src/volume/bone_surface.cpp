#include "xray_registration/volume/bone_surface.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "itk_surface.h"
#include "xray_registration/volume/attenuation.h"
#include "xray_registration/volume/volume_pyramid.h"

namespace xray_registration {
namespace {

// Marching cubes takes about a second for so many voxels of a skull; a display shows no more.
constexpr std::size_t kMaxVoxels = std::size_t{160} * 160 * 160;
constexpr std::size_t kMinVoxels = 64;

// A closed surface has twice as many triangles as vertices, and marching cubes about one vertex per edge between a
// voxel inside and one outside.
constexpr std::size_t kTrianglesPerEdge = 2;

// Read access with a border of air, one voxel wide, around the volume.
class Padded {
 public:
  Padded(const AttenuationVolume& volume, double level) : volume_(volume), level_(level) {
    for (int i = 0; i < 3; ++i) size_[static_cast<std::size_t>(i)] = volume.grid.size[i] + 2;
  }

  const std::array<int, 3>& size() const { return size_; }

  double value(int x, int y, int z) const {
    const Eigen::Vector3i& n = volume_.grid.size;
    if (x < 1 || y < 1 || z < 1 || x > n.x() || y > n.y() || z > n.z()) return 0.0;
    return volume_.values[(static_cast<std::size_t>(z - 1) * n.y() + (y - 1)) * n.x() + (x - 1)];
  }

  std::vector<std::uint8_t> mask() const {
    std::vector<std::uint8_t> mask;
    mask.reserve(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2]);
    for (int z = 0; z < size_[2]; ++z) {
      for (int y = 0; y < size_[1]; ++y) {
        for (int x = 0; x < size_[0]; ++x) mask.push_back(value(x, y, z) > level_ ? 1 : 0);
      }
    }
    return mask;
  }

  // Moves a vertex to where the value, interpolated tri-linearly, crosses the level: along the gradient, by Newton's
  // method, at most a voxel. ITK's vertices lie in the middle of edges and of cells.
  Eigen::Vector3d onLevel(const std::array<float, 3>& vertex) const {
    const Eigen::Vector3d start(vertex[0], vertex[1], vertex[2]);
    Eigen::Vector3d point = start;
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector4d sample = interpolated(point);
      const Eigen::Vector3d gradient = sample.head<3>();
      const double squared = gradient.squaredNorm();
      if (squared < 1e-6) break;
      const Eigen::Vector3d next = point + (level_ - sample[3]) / squared * gradient;
      if ((next - start).cwiseAbs().maxCoeff() > 1.0) break;
      point = next;
    }
    return point;
  }

 private:
  // Gradient and value.
  Eigen::Vector4d interpolated(const Eigen::Vector3d& point) const {
    const Eigen::Array3d low = point.array().floor();
    const Eigen::Array3d f = point.array() - low;
    const Eigen::Array3i i = low.cast<int>();
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Array3i high(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1);
      const Eigen::Array3d h = high.cast<double>();
      const Eigen::Array3d weight = h * f + (1.0 - h) * (1.0 - f);
      const Eigen::Array3d slope = 2.0 * h - 1.0;
      const double v = value(i.x() + high.x(), i.y() + high.y(), i.z() + high.z());
      sum += v * Eigen::Vector4d(slope.x() * weight.y() * weight.z(), weight.x() * slope.y() * weight.z(),
                                 weight.x() * weight.y() * slope.z(), weight.prod());
    }
    return sum;
  }

  const AttenuationVolume& volume_;
  double level_;
  std::array<int, 3> size_{};
};

std::size_t crossedEdges(const std::array<int, 3>& size, const std::vector<std::uint8_t>& mask) {
  const std::array<std::size_t, 3> stride = {1, static_cast<std::size_t>(size[0]),
                                             static_cast<std::size_t>(size[0]) * size[1]};
  std::size_t edges = 0;
  for (const std::size_t step : stride) {
    // The border is air on both sides, so that a step across it crosses nothing.
    for (std::size_t i = 0; i + step < mask.size(); ++i) edges += mask[i] != mask[i + step] ? 1 : 0;
  }
  return edges;
}

TriangleMesh meshOf(const Padded& padded, const std::vector<std::uint8_t>& mask, const VolumeGrid& grid) {
  const IndexMesh surface = surfaceOfMask(padded.size(), mask);
  TriangleMesh mesh;
  const Eigen::Affine3d ct_from_index = grid.ctFromIndex();
  mesh.vertices_ct_mm.reserve(surface.vertices.size());
  for (const auto& vertex : surface.vertices) {
    const Eigen::Vector3d index = padded.onLevel(vertex) - Eigen::Vector3d::Ones();
    mesh.vertices_ct_mm.push_back((ct_from_index * index).cast<float>());
  }
  mesh.triangles = surface.triangles;
  if (grid.direction.determinant() < 0.0) {
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);  // Still facing outwards.
  }
  return mesh;
}

/// Enough of a large volume for a display, without a copy of all of it.
AttenuationVolume reduced(const AttenuationVolume& volume) {
  const double voxels = static_cast<double>(volume.values.size());
  const int factor = std::max(1, static_cast<int>(std::cbrt(voxels / static_cast<double>(kMaxVoxels))));
  return factor == 1 ? volume : downsampled(volume, Eigen::Vector3i::Constant(factor));
}

}  // namespace

TriangleMesh boneSurface(const Volume& ct, double threshold_hu, std::size_t max_triangles) {
  const AttenuationModel model{0.02, -1000.0};
  if (!(threshold_hu > model.threshold_hu) || max_triangles == 0) return {};
  if (ct.hu.empty() || *std::max_element(ct.hu.begin(), ct.hu.end()) <= threshold_hu) return {};
  return isoSurface(toAttenuation(ct, model), model.water_per_mm * (1.0 + threshold_hu / 1000.0), max_triangles);
}

TriangleMesh isoSurface(const AttenuationVolume& given, double level_per_mm, std::size_t max_triangles) {
  if (given.values.empty() || !(level_per_mm > 0.0) || max_triangles == 0) return {};
  const double level = level_per_mm / given.scale_per_mm;
  if (*std::max_element(given.values.begin(), given.values.end()) <= level) return {};
  AttenuationVolume volume = fittedTo(reduced(given), kMaxVoxels * sizeof(std::uint16_t), {});
  for (;;) {
    const Padded padded(volume, level);
    const std::vector<std::uint8_t> mask = padded.mask();
    const std::size_t triangles = kTrianglesPerEdge * crossedEdges(padded.size(), mask);
    if (triangles <= max_triangles) {
      TriangleMesh mesh = meshOf(padded, mask, volume.grid);
      if (mesh.triangles.size() <= max_triangles) return mesh;
    }
    // The count grows with the area over the squared voxel size; a little more than needed, so that it ends.
    const double shrink = std::sqrt(static_cast<double>(max_triangles) / std::max(triangles, max_triangles + 1)) * 0.97;
    const auto voxels = static_cast<std::size_t>(static_cast<double>(volume.values.size()) * std::pow(shrink, 3));
    if (voxels < kMinVoxels) return {};
    volume = fittedTo(std::move(volume), voxels * sizeof(std::uint16_t), {});
  }
}

}  // namespace xray_registration
