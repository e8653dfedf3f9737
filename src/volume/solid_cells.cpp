#include "solid_cells.h"

#include <algorithm>
#include <cmath>

namespace xray_registration {
namespace {

constexpr double kCellsInSolid = 150000.0;
constexpr double kFinestCellMm = 0.3;
constexpr int kLayersOfAir = 2;

// A volume between its voxels, air beyond them.
class Density {
 public:
  explicit Density(const AttenuationVolume& volume) : volume_(volume) {}

  double at(const Eigen::Vector3d& index) const {
    const Eigen::Array3d low = index.array().floor();
    const Eigen::Array3i i = low.cast<int>();
    const Eigen::Array3d share = index.array() - low;
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Array3i step(corner & 1, (corner >> 1) & 1, corner >> 2);
      const Eigen::Array3d weight = (step == 0).select(1.0 - share, share);
      sum += weight.prod() * voxel(i + step);
    }
    return sum;
  }

 private:
  double voxel(const Eigen::Array3i& i) const {
    const Eigen::Vector3i& n = volume_.grid.size;
    if ((i < 0).any() || (i >= n.array()).any()) return 0.0;
    return volume_.values[(static_cast<std::size_t>(i.z()) * n.y() + i.y()) * n.x() + i.x()];
  }

  const AttenuationVolume& volume_;
};

double solidMm3(const AttenuationVolume& volume, double threshold) {
  const auto count =
      std::count_if(volume.values.begin(), volume.values.end(), [=](std::uint16_t value) { return value > threshold; });
  return static_cast<double>(count) * volume.grid.spacing_mm.prod();
}

// The box of the volume's voxels in cells, with air around it.
VolumeGrid cellGrid(const VolumeGrid& volume, double cell_mm) {
  const Eigen::Vector3d extent = volume.size.cast<double>().cwiseProduct(volume.spacing_mm);
  VolumeGrid grid;
  grid.direction = volume.direction;
  grid.spacing_mm.setConstant(cell_mm);
  grid.size = (extent / cell_mm).array().ceil().cast<int>() + 2 * kLayersOfAir;
  const Eigen::Vector3d half = 0.5 * cell_mm * (grid.size.array() - 1).cast<double>();
  grid.origin_ct_mm = volume.centreCt() - volume.direction * half;
  return grid;
}

// What cannot be reached from outside through faces of cells that are not solid becomes solid.
void fillCavities(SolidCells* cells) {
  constexpr std::uint8_t kOutside = 2;
  const Eigen::Vector3i n = cells->grid.size;
  const std::ptrdiff_t row = n.x();
  const std::ptrdiff_t slice = row * n.y();
  std::vector<std::ptrdiff_t> front = {0};  // A corner: air.
  cells->is_solid[0] = kOutside;
  while (!front.empty()) {
    const std::ptrdiff_t here = front.back();
    front.pop_back();
    const Eigen::Vector3i at(static_cast<int>(here % row), static_cast<int>(here % slice / row),
                             static_cast<int>(here / slice));
    const std::ptrdiff_t steps[] = {1, row, slice};
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        if (at[axis] == (sign < 0 ? 0 : n[axis] - 1)) continue;
        const std::ptrdiff_t next = here + sign * steps[axis];
        std::uint8_t& state = cells->is_solid[static_cast<std::size_t>(next)];
        if (state != 0) continue;
        state = kOutside;
        front.push_back(next);
      }
    }
  }
  for (std::uint8_t& state : cells->is_solid) state = state == kOutside ? 0 : 1;
}

struct Offset {
  Eigen::Vector3i step;
  double distance;  // In cells.
};

// All neighbours up to a distance, the nearest first.
std::vector<Offset> offsetsWithin(double distance) {
  std::vector<Offset> offsets;
  const int reach = static_cast<int>(std::floor(distance));
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const Eigen::Vector3i step(x, y, z);
        const double length = step.cast<double>().norm();
        if (length > 0.0 && length <= distance) offsets.push_back({step, length});
      }
    }
  }
  std::stable_sort(offsets.begin(), offsets.end(),
                   [](const Offset& a, const Offset& b) { return a.distance < b.distance; });
  return offsets;
}

}  // namespace

SolidCells solidCells(const AttenuationVolume& volume, double threshold_per_mm) {
  SolidCells cells;
  const double threshold = threshold_per_mm / volume.scale_per_mm;
  const double solid = solidMm3(volume, threshold);
  if (!(solid > 0.0)) return cells;
  const double cell_mm = std::max(kFinestCellMm, std::cbrt(solid / kCellsInSolid));
  cells.grid = cellGrid(volume.grid, cell_mm);
  cells.is_solid.reserve(cells.grid.voxelCount());
  const Eigen::Affine3d index_from_cell = volume.grid.ctFromIndex().inverse() * cells.grid.ctFromIndex();
  const Density density(volume);
  for (int z = 0; z < cells.grid.size.z(); ++z) {
    for (int y = 0; y < cells.grid.size.y(); ++y) {
      for (int x = 0; x < cells.grid.size.x(); ++x) {
        const bool is_solid = density.at(index_from_cell * Eigen::Vector3d(x, y, z)) > threshold;
        cells.is_solid.push_back(is_solid ? 1 : 0);
      }
    }
  }
  fillCavities(&cells);
  return cells;
}

std::vector<std::uint8_t> shareBelowSurface(const SolidCells& cells, double tolerance_mm) {
  std::vector<std::uint8_t> share(cells.is_solid.size(), 0);
  const Eigen::Vector3i& n = cells.grid.size;
  // The surface lies half a cell before the centre of the first cell outside; a cell counts in part when the tolerated
  // depth runs through it.
  const double tolerance = tolerance_mm / cells.grid.spacing_mm.x() + 0.5;
  const std::vector<Offset> offsets = offsetsWithin(tolerance + 0.5);
  const auto is_outside = [&](const Eigen::Vector3i& at) {
    if ((at.array() < 0).any() || (at.array() >= n.array()).any()) return true;
    return cells.is_solid[(static_cast<std::size_t>(at.z()) * n.y() + at.y()) * n.x() + at.x()] == 0;
  };
  std::size_t cell = 0;
  for (int z = 0; z < n.z(); ++z) {
    for (int y = 0; y < n.y(); ++y) {
      for (int x = 0; x < n.x(); ++x, ++cell) {
        if (cells.is_solid[cell] == 0) continue;
        const auto nearest = std::find_if(offsets.begin(), offsets.end(), [&](const Offset& offset) {
          return is_outside(Eigen::Vector3i(x, y, z) + offset.step);
        });
        const double below = nearest == offsets.end() ? 1.0 : nearest->distance - tolerance + 0.5;
        share[cell] = static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(below, 0.0, 1.0)));
      }
    }
  }
  return share;
}

}  // namespace xray_registration
