#include "xray_registration/volume/volume_pyramid.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "xray_registration/common/parallel.h"

namespace xray_registration {
namespace {

std::size_t rowStart(const Eigen::Vector3i& size, int y, int z) {
  return (static_cast<std::size_t>(z) * size.y() + y) * size.x();
}

// The part [begin, end) of an axis, in fine voxels, that one coarse voxel covers.
struct Cell {
  int first = 0;
  std::vector<float> weights;  // Of fine voxels first, first + 1, …
};

// Cells of `coarse` voxels over an axis of `fine` ones, `ratio` fine voxels long each. `normalise` makes the weights of
// a cell that reaches past the last voxel sum to one as if the axis went on; otherwise the rest is air.
std::vector<Cell> cellsOfAxis(int fine, int coarse, double ratio, bool normalise) {
  std::vector<Cell> cells(static_cast<std::size_t>(coarse));
  for (int i = 0; i < coarse; ++i) {
    Cell& cell = cells[static_cast<std::size_t>(i)];
    const double begin = i * ratio;
    const double end = std::min<double>(fine, (i + 1) * ratio);
    cell.first = std::min(static_cast<int>(begin), fine - 1);
    const double length = normalise ? std::max(end - begin, 1e-9) : ratio;
    for (int j = cell.first; j < fine && (j < end || j == cell.first); ++j) {
      const double covered = std::min<double>(end, j + 1) - std::max<double>(begin, j);
      cell.weights.push_back(static_cast<float>(std::max(covered, 0.0) / length));
    }
  }
  return cells;
}

// Box average of `volume` over boxes of `ratio` voxels, `size` of them.
AttenuationVolume boxAverage(const AttenuationVolume& volume, const Eigen::Vector3i& size,
                             const Eigen::Vector3d& ratio) {
  AttenuationVolume result;
  result.scale_per_mm = volume.scale_per_mm;
  result.face_is_cut = volume.face_is_cut;
  result.grid = volume.grid;
  result.grid.size = size;
  result.grid.spacing_mm = volume.grid.spacing_mm.cwiseProduct(ratio);
  result.grid.origin_ct_mm = volume.grid.ctFromIndex() * (0.5 * (ratio - Eigen::Vector3d::Ones())).eval();
  result.values.resize(result.grid.voxelCount());

  std::array<std::vector<Cell>, 3> cells;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    cells[a] = cellsOfAxis(volume.grid.size[axis], size[axis], ratio[axis], volume.face_is_cut[2 * a + 1]);
  }
  parallelFor(size.z(), [&](int begin, int end) {
    std::vector<float> sum(static_cast<std::size_t>(volume.grid.size.x()));
    for (int z = begin; z < end; ++z) {
      const Cell& cell_z = cells[2][static_cast<std::size_t>(z)];
      for (int y = 0; y < size.y(); ++y) {
        const Cell& cell_y = cells[1][static_cast<std::size_t>(y)];
        std::fill(sum.begin(), sum.end(), 0.0F);
        for (std::size_t k = 0; k < cell_z.weights.size(); ++k) {
          for (std::size_t j = 0; j < cell_y.weights.size(); ++j) {
            const float weight = cell_z.weights[k] * cell_y.weights[j];
            const std::uint16_t* row =
                volume.values.data() +
                rowStart(volume.grid.size, cell_y.first + static_cast<int>(j), cell_z.first + static_cast<int>(k));
            for (std::size_t x = 0; x < sum.size(); ++x) sum[x] += weight * static_cast<float>(row[x]);
          }
        }
        std::uint16_t* out = result.values.data() + rowStart(size, y, z);
        for (std::size_t x = 0; x < cells[0].size(); ++x) {
          const Cell& cell = cells[0][x];
          float value = 0.0F;
          for (std::size_t i = 0; i < cell.weights.size(); ++i) {
            value += cell.weights[i] * sum[static_cast<std::size_t>(cell.first) + i];
          }
          out[x] = static_cast<std::uint16_t>(std::min(value + 0.5F, 65535.0F));
        }
      }
    }
  });
  return result;
}

// The grid's size when no axis is finer than `spacing_mm`.
Eigen::Vector3i sizeAt(const VolumeGrid& grid, double spacing_mm) {
  Eigen::Vector3i size;
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = std::floor(grid.size[axis] * grid.spacing_mm[axis] / spacing_mm);
    size[axis] = static_cast<int>(std::clamp<double>(cells, 1.0, grid.size[axis]));
  }
  return size;
}

std::size_t bytesOf(const Eigen::Vector3i& size) {
  return sizeof(std::uint16_t) * static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) *
         static_cast<std::size_t>(size.z());
}

std::string sizeText(const Eigen::Vector3i& size) {
  std::ostringstream text;
  text << size.x() << "x" << size.y() << "x" << size.z();
  return text.str();
}

void checkSize(const AttenuationVolume& volume) {
  if ((volume.grid.size.array() < 1).any() || volume.values.size() != volume.grid.voxelCount()) {
    throw std::invalid_argument("the volume is empty or its number of voxels does not fit its grid");
  }
}

}  // namespace

AttenuationVolume downsampled(const AttenuationVolume& volume, const Eigen::Vector3i& factor) {
  checkSize(volume);
  if ((factor.array() < 1).any()) throw std::invalid_argument("a volume is averaged over at least one voxel");
  const Eigen::Vector3i size = (volume.grid.size + factor - Eigen::Vector3i::Ones()).cwiseQuotient(factor);
  return boxAverage(volume, size, factor.cast<double>());
}

std::vector<AttenuationVolume> coarserLevels(const AttenuationVolume& finest, int min_size, double max_spacing_mm) {
  checkSize(finest);
  std::vector<AttenuationVolume> levels;
  for (const AttenuationVolume* last = &finest; last->grid.size.maxCoeff() >= min_size; last = &levels.back()) {
    const VolumeGrid& grid = last->grid;
    Eigen::Vector3i factor = Eigen::Vector3i::Ones();
    const double finest_mm = grid.spacing_mm.minCoeff();
    for (int axis = 0; axis < 3; ++axis) {
      if (grid.spacing_mm[axis] <= 1.5 * finest_mm && grid.size[axis] > 1) factor[axis] = 2;
    }
    const double next_mm = grid.spacing_mm.cwiseProduct(factor.cast<double>()).minCoeff();
    if (factor == Eigen::Vector3i::Ones() || next_mm > max_spacing_mm) break;
    AttenuationVolume next = downsampled(*last, factor);
    levels.push_back(std::move(next));
  }
  return levels;
}

AttenuationVolume fittedTo(AttenuationVolume volume, std::size_t max_bytes, const Logger& logger) {
  checkSize(volume);
  if (bytesOf(volume.grid.size) <= max_bytes) return volume;
  // The finest spacing that fits: the axes that are finer than it are averaged, so that the voxels become isotropic.
  double fine_mm = volume.grid.spacing_mm.minCoeff();
  double coarse_mm = 2.0 * (volume.grid.size.cast<double>().cwiseProduct(volume.grid.spacing_mm)).maxCoeff();
  for (int i = 0; i < 50; ++i) {
    const double middle_mm = 0.5 * (fine_mm + coarse_mm);
    (bytesOf(sizeAt(volume.grid, middle_mm)) <= max_bytes ? coarse_mm : fine_mm) = middle_mm;
  }
  const Eigen::Vector3i size = sizeAt(volume.grid, coarse_mm);
  log(logger, LogLevel::kWarning,
      "The CT of " + sizeText(volume.grid.size) + " voxels is too large for the device: averaged down to " +
          sizeText(size) + " voxels");
  return boxAverage(volume, size, volume.grid.size.cast<double>().cwiseQuotient(size.cast<double>()));
}

}  // namespace xray_registration
