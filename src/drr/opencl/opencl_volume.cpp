#include "xray_registration/drr/opencl/opencl_volume.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drr/opencl/guarded.h"
#include "xray_registration/drr/opencl/layout.h"
#include "xray_registration/volume/volume_pyramid.h"

namespace xray_registration {
namespace {

using layout::kBrick;
using layout::kPadding;

struct Box {
  Eigen::Vector3i low;
  Eigen::Vector3i size;
};

/// Smallest box that holds every non-air voxel; a volume of air keeps one voxel.
Box tissueBox(const AttenuationVolume& volume) {
  const Eigen::Vector3i n = volume.grid.size;
  Eigen::Vector3i low = n;
  Eigen::Vector3i high = Eigen::Vector3i::Constant(-1);
  std::size_t row_start = 0;
  for (int z = 0; z < n.z(); ++z) {
    for (int y = 0; y < n.y(); ++y, row_start += static_cast<std::size_t>(n.x())) {
      const std::uint16_t* row = volume.values.data() + row_start;
      const std::uint16_t* end = row + n.x();
      const std::uint16_t* first = std::find_if(row, end, [](std::uint16_t v) { return v != 0; });
      if (first == end) continue;
      const std::uint16_t* last = end - 1;
      while (*last == 0) --last;
      low = low.cwiseMin(Eigen::Vector3i(static_cast<int>(first - row), y, z));
      high = high.cwiseMax(Eigen::Vector3i(static_cast<int>(last - row), y, z));
    }
  }
  if ((high.array() < 0).any()) return {Eigen::Vector3i::Zero(), Eigen::Vector3i::Ones()};
  return {low, high - low + Eigen::Vector3i::Ones()};
}

Eigen::Vector3i paddedSize(const Box& box) { return box.size + Eigen::Vector3i::Constant(2 * kPadding); }

std::size_t wordCount(const Eigen::Vector3i& padded) {
  return static_cast<std::size_t>(padded.x()) * static_cast<std::size_t>(padded.y()) *
         static_cast<std::size_t>(padded.z());
}

/// The rows of a padded box.
class PaddedRows {
 public:
  PaddedRows(const AttenuationVolume& volume, const Box& box) : volume_(volume), box_(box) {}

  /// The voxels behind the padding at its beginning, as many as the box has along x; null in the padding.
  const std::uint16_t* at(int y, int z) const {
    const int vy = y - kPadding;
    const int vz = z - kPadding;
    if (vy < 0 || vy >= box_.size.y() || vz < 0 || vz >= box_.size.z()) return nullptr;
    const Eigen::Vector3i n = volume_.grid.size;
    const std::size_t row = static_cast<std::size_t>(vz + box_.low.z()) * static_cast<std::size_t>(n.y()) +
                            static_cast<std::size_t>(vy + box_.low.y());
    return volume_.values.data() + row * static_cast<std::size_t>(n.x()) + box_.low.x();
  }
  int length() const { return box_.size.x(); }

 private:
  const AttenuationVolume& volume_;
  const Box& box_;
};

/// Writes each voxel's word: itself and its neighbour in z.
void packWords(const PaddedRows& rows, const Eigen::Vector3i& padded, cl_uint* words) {
  for (int z = 0; z < padded.z(); ++z) {
    for (int y = 0; y < padded.y(); ++y, words += padded.x()) {
      std::fill(words, words + padded.x(), 0U);
      const std::uint16_t* near = rows.at(y, z);
      const std::uint16_t* far = rows.at(y, z + 1);
      for (int x = 0; x < rows.length() && (near != nullptr || far != nullptr); ++x) {
        const cl_uint low = near != nullptr ? near[x] : 0U;
        const cl_uint high = far != nullptr ? far[x] : 0U;
        words[x + kPadding] = low | (high << 16U);
      }
    }
  }
}

/// Writes the voxels alone.
void packVoxels(const PaddedRows& rows, const Eigen::Vector3i& padded, cl_ushort* voxels) {
  for (int z = 0; z < padded.z(); ++z) {
    for (int y = 0; y < padded.y(); ++y, voxels += padded.x()) {
      std::fill(voxels, voxels + padded.x(), cl_ushort{0});
      if (const std::uint16_t* row = rows.at(y, z)) std::copy_n(row, rows.length(), voxels + kPadding);
    }
  }
}

/// A brick counts as occupied when a sample whose cell starts in it can touch tissue.
std::vector<cl_uchar> occupancyOf(const cl_uint* words, const Eigen::Vector3i& padded, const Eigen::Vector3i& bricks) {
  std::vector<cl_uchar> occupied(static_cast<std::size_t>(bricks.prod()), 0);
  const auto mark = [&](int x, int y, int z) {
    // The voxel is touched from its own cell and from the one below it on each axis.
    for (int dz = 0; dz < 2; ++dz) {
      for (int dy = 0; dy < 2; ++dy) {
        for (int dx = 0; dx < 2; ++dx) {
          const int bx = (x - dx) / kBrick;
          const int by = (y - dy) / kBrick;
          const int bz = (z - dz) / kBrick;
          occupied[static_cast<std::size_t>((bz * bricks.y() + by) * bricks.x() + bx)] = 1;
        }
      }
    }
  };
  for (int z = kPadding; z < padded.z() - kPadding; ++z) {
    for (int y = kPadding; y < padded.y() - kPadding; ++y) {
      const cl_uint* row =
          words + (static_cast<std::size_t>(z) * static_cast<std::size_t>(padded.y()) + static_cast<std::size_t>(y)) *
                      static_cast<std::size_t>(padded.x());
      for (int x = kPadding; x < padded.x() - kPadding; ++x) {
        if ((row[x] & 0xffffU) == 0U) continue;
        mark(x, y, z);
        // The rest of a run of tissue inside the same brick marks nothing new.
        while (x + 1 < padded.x() - kPadding && (x + 1) % kBrick > 1 && (row[x + 1] & 0xffffU) != 0U) ++x;
      }
    }
  }
  return occupied;
}

/// A level's words in the host's hands.
class MappedWords {
 public:
  MappedWords(const cl::CommandQueue& queue, const cl::Buffer& buffer, std::size_t bytes)
      : queue_(queue),
        buffer_(buffer),
        words_(static_cast<cl_uint*>(queue.enqueueMapBuffer(buffer, CL_TRUE, CL_MAP_WRITE, 0, bytes))) {}
  /// Memory of the host may be missing in between.
  ~MappedWords() {
    try {
      unmap();
    } catch (const cl::Error&) {
      // Something else has failed already.
    }
  }
  MappedWords(const MappedWords&) = delete;
  MappedWords& operator=(const MappedWords&) = delete;

  cl_uint* words() const { return words_; }
  void unmap() {
    if (cl_uint* words = std::exchange(words_, nullptr)) queue_.enqueueUnmapMemObject(buffer_, words);
  }

 private:
  const cl::CommandQueue& queue_;
  const cl::Buffer& buffer_;
  cl_uint* words_;
};

constexpr std::size_t kWithVoxels = sizeof(cl_uint) + sizeof(cl_ushort);

/// Whether a CT's voxels stand behind their words: on a CPU, where that takes no more than 64 MiB for the finest level.
bool keepsVoxels(const Device& device, const Box& finest, const VolumeLimits& limits) {
  constexpr std::size_t kMost = std::size_t{1} << 25U;
  const std::size_t words = wordCount(paddedSize(finest));
  return hasVoxels16(device) && words <= kMost && words * kWithVoxels <= limits.buffer_bytes;
}

OpenClLevel makeLevel(const Device& device, const AttenuationVolume& volume, const Box& box, const VolumeLimits& limits,
                      bool has_voxels) {
  const Eigen::Vector3i padded = paddedSize(box);
  const Eigen::Vector3i bricks = (padded + Eigen::Vector3i::Constant(kBrick - 1)) / kBrick;
  checkFits(padded, limits, device.name());
  const OpenClDevice& opencl = device.openCl();
  OpenClLevel level;
  const std::size_t words = wordCount(padded);
  level.grid.has_voxels = has_voxels ? 1 : 0;
  level.bytes = words * (has_voxels ? kWithVoxels : sizeof(cl_uint));
  level.words = cl::Buffer(opencl.context, CL_MEM_READ_ONLY | CL_MEM_ALLOC_HOST_PTR, level.bytes);
  MappedWords mapped(opencl.upload_queue, level.words, level.bytes);
  const PaddedRows rows(volume, box);
  packWords(rows, padded, mapped.words());
  if (has_voxels) packVoxels(rows, padded, reinterpret_cast<cl_ushort*>(mapped.words() + words));
  const std::vector<cl_uchar> occupied = occupancyOf(mapped.words(), padded, bricks);
  mapped.unmap();
  level.occupancy = cl::Buffer(opencl.context, CL_MEM_READ_ONLY, occupied.size());
  opencl.upload_queue.enqueueWriteBuffer(level.occupancy, CL_TRUE, 0, occupied.size(), occupied.data());
  opencl.upload_queue.finish();
  level.bytes += occupied.size();

  for (int axis = 0; axis < 3; ++axis) {
    level.grid.size[axis] = padded[axis];
    level.grid.bricks[axis] = bricks[axis];
    level.grid.centre[axis] = 0.5F * static_cast<float>(padded[axis] - 1);
  }
  Eigen::Affine3d padded_from_index = Eigen::Affine3d::Identity();
  padded_from_index.translation() = (Eigen::Vector3i::Constant(kPadding) - box.low).cast<double>();
  level.index_from_ct = padded_from_index * volume.grid.ctFromIndex().inverse();
  level.scale_per_mm = volume.scale_per_mm;
  for (std::size_t face = 0; face < 6; ++face) level.cut_faces |= volume.face_is_cut[face] ? 1 << face : 0;
  level.spacing_mm = std::cbrt(volume.grid.spacing_mm.prod());
  return level;
}

/// As far as interpolation carries the outermost voxels.
std::vector<Eigen::Vector3d> cornersOf(const Box& box, const VolumeGrid& grid) {
  std::vector<Eigen::Vector3d> corners;
  const Eigen::Vector3d low = box.low.cast<double>().array() - 1.0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d which(i & 1, (i >> 1) & 1, (i >> 2) & 1);
    corners.emplace_back(grid.ctFromIndex() *
                         (low + which.cwiseProduct((box.size.array() + 1).matrix().cast<double>())).eval());
  }
  return corners;
}

}  // namespace

bool hasVoxels16(const Device& device) { return !device.isGpu(); }

OpenClVolume::OpenClVolume(const Device& device, const AttenuationVolume& volume)
    : OpenClVolume(device, volume, volumeLimits(device)) {}

OpenClVolume::OpenClVolume(const Device& device, const AttenuationVolume& volume, const VolumeLimits& limits) {
  const Box box = tissueBox(volume);
  guarded(device.name(), "placing the CT", [&] {
    const bool has_voxels = keepsVoxels(device, box, limits);
    levels_.push_back(makeLevel(device, volume, box, limits, has_voxels));
    for (const AttenuationVolume& level : coarserLevels(volume)) {
      levels_.push_back(makeLevel(device, level, tissueBox(level), limits, has_voxels));
    }
  });
  std::vector<ResidentVolume::Level> seen;
  for (const OpenClLevel& level : levels_) seen.push_back({level.spacing_mm, level.bytes});
  const double radius_mm = 0.5 * box.size.cast<double>().cwiseProduct(volume.grid.spacing_mm).norm();
  description_ = ResidentVolume(std::move(seen), anatomicalCentreCt(volume), radius_mm, cornersOf(box, volume.grid));
}

}  // namespace xray_registration
