#include "xray_registration/geometry/volume_grid.h"

namespace xray_registration {

std::size_t VolumeGrid::voxelCount() const {
  return static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(size.z());
}

Eigen::Affine3d VolumeGrid::ctFromIndex() const {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  transform.linear() = direction * spacing_mm.asDiagonal();
  transform.translation() = origin_ct_mm;
  return transform;
}

Eigen::Vector3d VolumeGrid::centreCt() const {
  return ctFromIndex() * (0.5 * (size.cast<double>() - Eigen::Vector3d::Ones())).eval();
}

std::array<Eigen::Vector3d, 8> VolumeGrid::cornersCt() const {
  const Eigen::Affine3d ct_from_index = ctFromIndex();
  std::array<Eigen::Vector3d, 8> corners;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int axis = 0; axis < 3; ++axis) index[axis] = ((corner >> axis) & 1) != 0 ? size[axis] - 0.5 : -0.5;
    corners[static_cast<std::size_t>(corner)] = ct_from_index * index;
  }
  return corners;
}

bool VolumeGrid::sameAs(const VolumeGrid& other, double tolerance_mm) const {
  if (size != other.size) return false;
  const auto corners = cornersCt();
  const auto other_corners = other.cornersCt();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if ((corners[i] - other_corners[i]).norm() > tolerance_mm) return false;
  }
  return true;
}

}  // namespace xray_registration
