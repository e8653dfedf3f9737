#include "xray_registration/evaluation/pose_error.h"

namespace xray_registration {

std::vector<Eigen::Vector3d> targetGrid(const Eigen::Vector3d& centre_ct_mm, double target_size_mm) {
  constexpr int kPerAxis = 5;
  const double step_mm = target_size_mm / (kPerAxis - 1);
  std::vector<Eigen::Vector3d> targets_ct_mm;
  targets_ct_mm.reserve(kPerAxis * kPerAxis * kPerAxis);
  for (int z = 0; z < kPerAxis; ++z) {
    for (int y = 0; y < kPerAxis; ++y) {
      for (int x = 0; x < kPerAxis; ++x) {
        const Eigen::Vector3d offset_mm =
            step_mm * Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Constant(target_size_mm / 2.0);
        targets_ct_mm.push_back(centre_ct_mm + offset_mm);
      }
    }
  }
  return targets_ct_mm;
}

PoseError poseError(const RigidTransform& T_camera_ct_found, const RigidTransform& T_camera_ct_true,
                    const std::vector<Eigen::Vector3d>& targets_ct_mm) {
  PoseError error;
  if (targets_ct_mm.empty()) return error;
  for (const Eigen::Vector3d& target_ct_mm : targets_ct_mm) {
    const Eigen::Vector3d difference_mm = T_camera_ct_found * target_ct_mm - T_camera_ct_true * target_ct_mm;
    error.mtre_mm += difference_mm.norm();
    error.inplane_mm += difference_mm.head<2>().norm();
  }
  const double count = static_cast<double>(targets_ct_mm.size());
  error.mtre_mm /= count;
  error.inplane_mm /= count;
  return error;
}

}  // namespace xray_registration
