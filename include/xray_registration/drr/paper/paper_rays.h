#pragma once

#include "xray_registration/geometry/volume_grid.h"
#include "xray_registration/geometry/xray_camera.h"

namespace xray_registration {

/// The rays of one image in the paper's sampling: every ray meets the same concentric spheres around the source, so all
/// share one list of distances t_s = first_mm + s · step_mm, s = 0 … samples − 1. Positions are continuous voxel
/// indices (integers are voxel centres): p(u, v, s) = origin + t_s · (corner + u · column + v · row) / |ray(u, v)|,
/// with |ray| = √(((u − cx)/fx)² + ((v − cy)/fy)² + 1).
struct PaperRays {
  int width = 0;
  int height = 0;
  int samples = 0;
  float first_mm = 0.0F;
  float step_mm = 0.0F;
  float cx = 0.0F;
  float cy = 0.0F;
  float inverse_fx = 0.0F;
  float inverse_fy = 0.0F;
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();  ///< The source.
  Eigen::Vector3f corner = Eigen::Vector3f::Zero();  ///< Per mm of depth, pixel (0, 0).
  Eigen::Vector3f column = Eigen::Vector3f::Zero();  ///< Change from one column to the next.
  Eigen::Vector3f row = Eigen::Vector3f::Zero();     ///< Change from one row to the next.
  /// What the sum of a ray's samples is multiplied with: 1 for the paper's plain sum, step_mm for line integrals.
  float scale = 1.0F;
};

/// The spheres cover the ball around the grid's box, so they do not depend on the volume's rotation: finite differences
/// see no jump of the sampling.
/// @param samples m of the paper, at least 2.
PaperRays paperRays(const VolumeGrid& grid, const XrayCamera& camera, const RigidTransform& T_camera_ct, int samples,
                    bool line_integrals);

/// m = 3 Lz, with Lz the voxels along the grid's axis that the camera's z axis is most parallel to.
int paperSampleCount(const VolumeGrid& grid, const RigidTransform& T_camera_ct);

/// The paper's arrangement: source at 2.5 Lz from the volume's centre, plane at 1.5 Lz on the other side, volume axes
/// parallel to camera axes; Lz is the box's length along z in mm. `plane_width_mm` and the pixel count are left open by
/// the paper.
struct PaperGeometry {
  XrayCamera camera;
  RigidTransform T_camera_ct = RigidTransform::Identity();
};
PaperGeometry paperGeometry(const VolumeGrid& grid, int image_size, double plane_width_mm);

}  // namespace xray_registration
