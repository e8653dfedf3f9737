#include "xray_registration/drr/opencl/pose_parameters.h"

namespace xray_registration {
namespace {

void store(const Eigen::Matrix3d& matrix, int offset, PoseParameters* parameters) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      (*parameters)[static_cast<std::size_t>(offset + 3 * row + column)] = static_cast<float>(matrix(row, column));
    }
  }
}

void store(const Eigen::Vector3d& vector, int offset, PoseParameters* parameters) {
  for (int i = 0; i < 3; ++i) (*parameters)[static_cast<std::size_t>(offset + i)] = static_cast<float>(vector[i]);
}

}  // namespace

PoseParameters poseParameters(const OpenClLevel& level, const XrayCamera& camera, const RigidTransform& T_camera_ct,
                              const Eigen::Vector3d& centre_camera_mm) {
  return poseParameters(level, camera, Eigen::Affine3d(T_camera_ct.inverse()), centre_camera_mm);
}

PoseParameters poseParameters(const OpenClLevel& level, const XrayCamera& camera, const Eigen::Affine3d& T_ct_camera,
                              const Eigen::Vector3d& centre_camera_mm) {
  PoseParameters parameters{};
  // G carries camera millimetres to voxel steps.
  const Eigen::Matrix3d G = level.index_from_ct.linear() * T_ct_camera.linear();
  const double mid_u = 0.5 * (camera.width - 1);
  const double mid_v = 0.5 * (camera.height - 1);
  Eigen::Matrix3d camera_from_pixel = Eigen::Matrix3d::Zero();
  camera_from_pixel(0, 0) = 1.0 / camera.fx;
  camera_from_pixel(0, 2) = (mid_u - camera.cx) / camera.fx;
  camera_from_pixel(1, 1) = 1.0 / camera.fy;
  camera_from_pixel(1, 2) = (mid_v - camera.cy) / camera.fy;
  camera_from_pixel(2, 2) = 1.0;
  const Eigen::Matrix3d direction = G * camera_from_pixel;

  const Eigen::Vector3d box_centre(level.grid.centre[0], level.grid.centre[1], level.grid.centre[2]);
  const Eigen::Vector3d source = level.index_from_ct * T_ct_camera.translation().eval() - box_centre;
  Eigen::Matrix3d cross;
  for (int column = 0; column < 3; ++column) cross.col(column) = source.cross(direction.col(column));

  store(direction, layout::kPoseDirection, &parameters);
  store(cross, layout::kPoseCross, &parameters);
  store(G, layout::kPoseRotation, &parameters);
  store(source, layout::kPoseSource, &parameters);
  // Source in the CT frame: -R'ᵀ t' with R' = exp(ω) R, t' = exp(ω)(t - c) + c + v. At zero its derivative is
  // Rᵀ(e_i × c) by ω_i and -Rᵀ e_i by v_i.
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(i);
    store(Eigen::Vector3d(-G * axis), layout::kPoseSourceDerivative + 3 * i, &parameters);
    store(Eigen::Vector3d(G * axis.cross(centre_camera_mm)), layout::kPoseSourceDerivative + 9 + 3 * i, &parameters);
  }
  parameters[layout::kPoseScale] = level.scale_per_mm;
  parameters[layout::kPoseInverseFx] = static_cast<float>(1.0 / camera.fx);
  parameters[layout::kPoseInverseFy] = static_cast<float>(1.0 / camera.fy);
  parameters[layout::kPoseCx] = static_cast<float>(camera.cx - mid_u);
  parameters[layout::kPoseCy] = static_cast<float>(camera.cy - mid_v);
  parameters[layout::kPoseMiddleU] = static_cast<float>(mid_u);
  parameters[layout::kPoseMiddleV] = static_cast<float>(mid_v);
  return parameters;
}

}  // namespace xray_registration
