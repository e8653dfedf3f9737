#include "xray_registration/drr/paper/paper_rays.h"

#include <algorithm>

namespace xray_registration {

PaperRays paperRays(const VolumeGrid& grid, const XrayCamera& camera, const RigidTransform& T_camera_ct, int samples,
                    bool line_integrals) {
  const Eigen::Affine3d index_from_camera =
      grid.ctFromIndex().inverse() * Eigen::Affine3d(T_camera_ct.inverse().matrix());
  const Eigen::Matrix3d linear = index_from_camera.linear();

  PaperRays rays;
  rays.width = camera.width;
  rays.height = camera.height;
  rays.samples = std::max(samples, 2);
  rays.origin = index_from_camera.translation().cast<float>();
  rays.corner = (linear * camera.rayDirection(0.0, 0.0)).cast<float>();
  rays.column = (linear.col(0) / camera.fx).cast<float>();
  rays.row = (linear.col(1) / camera.fy).cast<float>();
  rays.cx = static_cast<float>(camera.cx);
  rays.cy = static_cast<float>(camera.cy);
  rays.inverse_fx = static_cast<float>(1.0 / camera.fx);
  rays.inverse_fy = static_cast<float>(1.0 / camera.fy);

  const double radius_mm = 0.5 * grid.size.cast<double>().cwiseProduct(grid.spacing_mm).norm();
  const double centre_mm = (T_camera_ct * grid.centreCt()).norm();
  // A source inside the ball: rays start at it.
  const double first_mm = std::max(centre_mm - radius_mm, 0.0);
  const double step_mm = (centre_mm + radius_mm - first_mm) / rays.samples;
  // Samples in the middle of their shells: the sum is the midpoint rule.
  rays.first_mm = static_cast<float>(first_mm + 0.5 * step_mm);
  rays.step_mm = static_cast<float>(step_mm);
  rays.scale = line_integrals ? rays.step_mm : 1.0F;
  return rays;
}

int paperSampleCount(const VolumeGrid& grid, const RigidTransform& T_camera_ct) {
  const Eigen::Vector3d view_axis_index = (T_camera_ct.linear() * grid.direction).row(2).cwiseAbs().transpose();
  Eigen::Index axis = 0;
  view_axis_index.maxCoeff(&axis);
  return 3 * grid.size[axis];
}

PaperGeometry paperGeometry(const VolumeGrid& grid, int image_size, double plane_width_mm) {
  const double length_mm = grid.size.z() * grid.spacing_mm.z();
  const double source_to_plane_mm = (2.5 + 1.5) * length_mm;
  PaperGeometry geometry;
  geometry.camera.width = image_size;
  geometry.camera.height = image_size;
  geometry.camera.fx = source_to_plane_mm / (plane_width_mm / image_size);
  geometry.camera.fy = geometry.camera.fx;
  geometry.camera.cx = 0.5 * (image_size - 1);
  geometry.camera.cy = 0.5 * (image_size - 1);
  geometry.T_camera_ct.linear() = grid.direction.transpose();
  geometry.T_camera_ct.translation() =
      Eigen::Vector3d(0.0, 0.0, 2.5 * length_mm) - geometry.T_camera_ct.linear() * grid.centreCt();
  return geometry;
}

}  // namespace xray_registration
