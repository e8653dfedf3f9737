#include <algorithm>
#include <cmath>
#include <sstream>

#include "mesh_readers.h"
#include "mesh_scanline.h"
#include "xray_registration/common/parallel.h"
#include "xray_registration/volume/surface_mesh.h"

namespace xray_registration {
namespace {

constexpr int kLinesPerVoxelAxis = 4;
constexpr double kLargestValue = 65535.0;
constexpr double kMaxVoxels = 40e6;
// Nothing that a surgeon navigates is smaller or larger.
constexpr double kShortestMm = 2.0;
constexpr double kLongestMm = 1000.0;
// Of a metal, 1/mm: gold at 40 keV has some 25.
constexpr double kLargestAttenuation = 100.0;
// A voxel is this part of the box's mean edge, or of a thickness where that is finer.
constexpr double kVoxelsPerEdge = 120.0;
constexpr double kVoxelsPerThickness = 8.0;
constexpr double kFinestMm = 0.1;
constexpr double kCoarsestMm = 1.0;

struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30);
  Eigen::Vector3d high = Eigen::Vector3d::Constant(-1e30);
  Eigen::Vector3d extent() const { return high - low; }
};

// Of the points that triangles use.
Box boxOf(const SurfaceMesh& mesh) {
  Box box;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      const Eigen::Vector3d point = mesh.points_mm[corner].cast<double>();
      box.low = box.low.cwiseMin(point);
      box.high = box.high.cwiseMax(point);
    }
  }
  return box;
}

template <typename Value>
[[noreturn]] void refuseValue(const std::string& name, const char* what, Value value, const std::string& allowed) {
  std::ostringstream text;
  text << what << " is " << value << ": " << allowed;
  refuseMesh(name, text.str());
}

void checkMesh(const SurfaceMesh& mesh, const std::string& name) {
  for (const Eigen::Vector3f& point : mesh.points_mm) {
    if (!point.allFinite()) refuseMesh(name, "a coordinate in it is no finite number");
  }
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) {
      if (corner >= mesh.points_mm.size()) refuseMesh(name, "a triangle of it names a point that is not there");
    }
  }
}

void checkSize(const Box& box, const std::string& name) {
  const double longest = box.extent().maxCoeff();
  if (longest < kShortestMm) {
    refuseValue(name, "its length in mm", longest,
                "a mesh must be in millimetres; if it is in metres, scale it by 1000 and save it again");
  }
  if (longest > kLongestMm) {
    refuseValue(name, "its length in mm", longest,
                "a mesh must be in millimetres and shorter than 1 m; scale it and save it again");
  }
}

double surfaceArea(const SurfaceMesh& mesh) {
  double area = 0.0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.points_mm[t[0]].cast<double>();
    const Eigen::Vector3d along = mesh.points_mm[t[1]].cast<double>() - a;
    area += 0.5 * along.cross(mesh.points_mm[t[2]].cast<double>() - a).norm();
  }
  return area;
}

Eigen::Vector3d voxelsNeeded(const Box& box, double spacing_mm) {
  return (box.extent() / spacing_mm).array().ceil() + 2.0;
}

double chosenSpacing(const SurfaceMesh& mesh, const Box& box) {
  const double edge = std::cbrt(box.extent().cwiseMax(kFinestMm).prod());
  // A rod's diameter; twice a plate's thickness.
  const double thickness = 4.0 * std::abs(signedVolume(mesh)) / std::max(surfaceArea(mesh), 1e-9);
  double spacing = std::clamp(std::min(edge / kVoxelsPerEdge, thickness / kVoxelsPerThickness), kFinestMm, kCoarsestMm);
  while (voxelsNeeded(box, spacing).prod() > kMaxVoxels) spacing *= 1.05;
  return spacing;
}

// Adds the share of each voxel that a span covers; voxel i reaches from i to i + 1.
void addSpan(double from, double to, float* row) {
  const auto first = static_cast<std::ptrdiff_t>(std::floor(from));
  const auto last = static_cast<std::ptrdiff_t>(std::floor(to));
  if (first == last) {
    row[first] += static_cast<float>(to - from);
    return;
  }
  row[first] += static_cast<float>(static_cast<double>(first + 1) - from);
  for (std::ptrdiff_t i = first + 1; i < last; ++i) row[i] += 1.0F;
  row[last] += static_cast<float>(to - static_cast<double>(last));
}

class Voxeliser {
 public:
  Voxeliser(const ClosedSurface& surface, const VolumeGrid& grid)
      : surface_(surface), grid_(grid), triangles_of_slice_(static_cast<std::size_t>(grid.size.z())) {
    const auto& mesh = surface.mesh;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      double low = 1e30;
      double high = -1e30;
      for (const std::uint32_t corner : mesh.triangles[t]) {
        low = std::min<double>(low, mesh.points_mm[corner].z());
        high = std::max<double>(high, mesh.points_mm[corner].z());
      }
      const int last = std::min(sliceOf(high), grid.size.z() - 1);
      for (int z = std::max(sliceOf(low), 0); z <= last; ++z)
        triangles_of_slice_[static_cast<std::size_t>(z)].push_back(t);
    }
  }

  void fillSlice(int z, std::uint16_t* values) const {
    const auto width = static_cast<std::size_t>(grid_.size.x());
    std::vector<float> covered(width * static_cast<std::size_t>(grid_.size.y()), 0.0F);
    for (int line = 0; line < kLinesPerVoxelAxis; ++line) {
      const MeshSlice slice(surface_, triangles_of_slice_[static_cast<std::size_t>(z)], lineAt(2, z, line));
      addSlice(slice, covered.data());
    }
    const double full = kLinesPerVoxelAxis * kLinesPerVoxelAxis;
    for (std::size_t i = 0; i < covered.size(); ++i) {
      values[i] = static_cast<std::uint16_t>(std::lround(std::min(1.0, covered[i] / full) * kLargestValue));
    }
  }

 private:
  double spacing() const { return grid_.spacing_mm.x(); }

  int sliceOf(double z) const { return static_cast<int>(std::floor((z - grid_.origin_ct_mm.z()) / spacing() + 0.5)); }

  // Coordinate of one of the lines that sample a voxel.
  double lineAt(int axis, int voxel, int line) const {
    return grid_.origin_ct_mm[axis] + spacing() * (voxel - 0.5 + (line + 0.5) / kLinesPerVoxelAxis);
  }

  void addSlice(const MeshSlice& slice, float* covered) const {
    const double left = grid_.origin_ct_mm.x() - 0.5 * spacing();
    for (int y = 0; y < grid_.size.y(); ++y) {
      for (int line = 0; line < kLinesPerVoxelAxis; ++line) {
        const double at = lineAt(1, y, line);
        if (at < slice.lowY() || at > slice.highY()) continue;
        float* row = covered + static_cast<std::ptrdiff_t>(y) * grid_.size.x();
        for (const Span& span : slice.spansAt(at))
          addSpan((span.from - left) / spacing(), (span.to - left) / spacing(), row);
      }
    }
  }

  const ClosedSurface& surface_;
  const VolumeGrid& grid_;
  std::vector<std::vector<std::uint32_t>> triangles_of_slice_;
};

VolumeGrid gridFor(const Box& box, double spacing_mm) {
  VolumeGrid grid;
  grid.size = voxelsNeeded(box, spacing_mm).cast<int>();
  grid.spacing_mm.setConstant(spacing_mm);
  // The mesh in the middle.
  grid.origin_ct_mm = 0.5 * (box.low + box.high) - 0.5 * spacing_mm * (grid.size.cast<double>().array() - 1.0).matrix();
  return grid;
}

}  // namespace

AttenuationVolume voxelise(const SurfaceMesh& mesh, double attenuation_per_mm, double spacing_mm,
                           const std::string& name) {
  if (!(attenuation_per_mm > 0.0 && attenuation_per_mm <= kLargestAttenuation)) {
    refuseValue(name, "its attenuation", attenuation_per_mm, "it must lie in (0, 100] per millimetre");
  }
  if (!(spacing_mm >= 0.0 && spacing_mm <= kLongestMm)) {
    refuseValue(name, "the voxel size for it", spacing_mm, "it must be positive, or 0 to be chosen");
  }
  checkMesh(mesh, name);
  const Box box = boxOf(mesh);
  if (!mesh.triangles.empty()) checkSize(box, name);
  const ClosedSurface surface = closedSurface(mesh, name);
  const double spacing = spacing_mm > 0.0 ? spacing_mm : chosenSpacing(surface.mesh, box);
  if (voxelsNeeded(box, spacing).prod() > kMaxVoxels) {
    refuseValue(name, "the voxel size for it", spacing, "that makes more than 40 million voxels; take a larger one");
  }
  AttenuationVolume volume;
  volume.grid = gridFor(box, spacing);
  volume.scale_per_mm = static_cast<float>(attenuation_per_mm / kLargestValue);
  volume.values.resize(volume.grid.voxelCount());
  const Voxeliser voxeliser(surface, volume.grid);
  const std::size_t slice = volume.values.size() / static_cast<std::size_t>(volume.grid.size.z());
  parallelFor(volume.grid.size.z(), [&](int begin, int end) {
    for (int z = begin; z < end; ++z)
      voxeliser.fillSlice(z, volume.values.data() + static_cast<std::size_t>(z) * slice);
  });
  return volume;
}

}  // namespace xray_registration
