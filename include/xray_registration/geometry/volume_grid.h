#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>

namespace xray_registration {

/// Where a volume's voxels lie in the CT frame (DICOM patient system, LPS, mm), exactly as the file states it.
/// Integer indices are voxel centres; x runs fastest in memory, then y, then z.
struct VolumeGrid {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  Eigen::Vector3d origin_ct_mm = Eigen::Vector3d::Zero();   ///< Centre of voxel (0, 0, 0).
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();  ///< Columns: axes of the indices in the CT frame.

  std::size_t voxelCount() const;

  /// Maps (continuous) voxel indices to CT coordinates in mm.
  Eigen::Affine3d ctFromIndex() const;

  /// Centre of the grid's box in CT coordinates, mm.
  Eigen::Vector3d centreCt() const;

  /// The eight corners of the box that the voxels (not their centres) fill, CT coordinates in mm.
  std::array<Eigen::Vector3d, 8> cornersCt() const;

  bool sameAs(const VolumeGrid& other, double tolerance_mm = 1e-3) const;
};

}  // namespace xray_registration
