#pragma once

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// Exact line integral of the voxel boxes along the ray from the source (camera origin) through pixel (u, v), in
/// double: Siddon 1985, "Fast calculation of the exact radiological path for a three-dimensional CT array".
/// Dimensionless (1/mm · mm). The source may lie inside the volume. The ray ends at infinity. A ray that misses, and a
/// volume without voxels, give 0.
double referenceLineIntegral(const AttenuationVolume& volume, const RigidTransform& T_camera_ct,
                             const XrayCamera& camera, double u, double v);

/// A whole image of them, over all host threads; the result does not depend on their number. Used by the simulator and
/// by tests, and by nothing that registers.
/// @param samples_per_pixel_axis  n > 1 averages the line integrals of an n × n grid inside each pixel.
/// @throws std::invalid_argument for a camera with a problem, fewer than one sample, or voxels that do not fill the
/// grid.
FloatImage referenceProjection(const AttenuationVolume& volume, const RigidTransform& T_camera_ct,
                               const XrayCamera& camera, int samples_per_pixel_axis = 1);

}  // namespace xray_registration
