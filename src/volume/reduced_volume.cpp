#include "xray_registration/volume/reduced_volume.h"

namespace xray_registration {

namespace {

std::int16_t blockMean(const Volume& ct, const Eigen::Vector3i& first, int factor) {
  long sum = 0;
  for (int z = 0; z < factor; ++z) {
    for (int y = 0; y < factor; ++y) {
      const std::size_t row =
          (static_cast<std::size_t>(first.z() + z) * ct.grid.size.y() + first.y() + y) * ct.grid.size.x() + first.x();
      for (int x = 0; x < factor; ++x) sum += ct.hu[row + x];
    }
  }
  return static_cast<std::int16_t>(sum / (factor * factor * factor));
}

}  // namespace

Volume reducedForDisplay(const Volume& ct, std::size_t max_voxels) {
  int factor = 1;
  const auto voxels = [&](int f) {
    const Eigen::Vector3i size = ct.grid.size / f;
    return static_cast<std::size_t>(size.x()) * size.y() * size.z();
  };
  while (voxels(factor) > max_voxels && ct.grid.size.minCoeff() >= 2 * (factor + 1)) ++factor;
  if (factor == 1) return ct;
  Volume reduced;
  reduced.name = ct.name;
  reduced.grid = ct.grid;
  reduced.grid.size = ct.grid.size / factor;
  reduced.grid.spacing_mm = ct.grid.spacing_mm * factor;
  // The first voxel's centre is the centre of its block.
  const double shift = 0.5 * (factor - 1);
  reduced.grid.origin_ct_mm = ct.grid.ctFromIndex() * Eigen::Vector3d(shift, shift, shift);
  reduced.hu.reserve(reduced.grid.voxelCount());
  for (int z = 0; z < reduced.grid.size.z(); ++z) {
    for (int y = 0; y < reduced.grid.size.y(); ++y) {
      for (int x = 0; x < reduced.grid.size.x(); ++x) {
        reduced.hu.push_back(blockMean(ct, factor * Eigen::Vector3i(x, y, z), factor));
      }
    }
  }
  return reduced;
}

}  // namespace xray_registration
