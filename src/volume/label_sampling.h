#pragma once

#include <Eigen/Geometry>
#include <cstddef>

#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// @throws VolumeError when the labels do not fill their grid.
void checkLabels(const LabelVolume& labels);

/// Calls visit(voxel, label) for every voxel of the slices [begin, end) of `grid`, in the order of memory: the label
/// that lies nearest in the CT frame, background (0) beyond the labels' grid.
template <typename Visit>
void forEachLabel(const LabelVolume& labels, const VolumeGrid& grid, int begin, int end, const Visit& visit) {
  const Eigen::Affine3d label_from_voxel = labels.grid.ctFromIndex().inverse() * grid.ctFromIndex();
  const Eigen::Vector3d step = label_from_voxel.linear().col(0);
  const Eigen::Array3d label_size = labels.grid.size.cast<double>().array();
  const Eigen::Vector3i& n = labels.grid.size;
  std::size_t voxel = static_cast<std::size_t>(begin) * grid.size.y() * grid.size.x();
  for (int z = begin; z < end; ++z) {
    for (int y = 0; y < grid.size.y(); ++y) {
      const Eigen::Vector3d start = label_from_voxel * Eigen::Vector3d(0.0, y, z);
      for (int x = 0; x < grid.size.x(); ++x, ++voxel) {
        const Eigen::Array3d nearest = ((start + x * step).array() + 0.5).floor();
        int label = 0;
        if ((nearest >= 0.0).all() && (nearest < label_size).all()) {
          const Eigen::Array3i i = nearest.cast<int>();
          label = labels.labels[(static_cast<std::size_t>(i.z()) * n.y() + i.y()) * n.x() + i.x()];
        }
        visit(voxel, label);
      }
    }
  }
}

}  // namespace xray_registration
