#pragma once

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// Exact line integral of the voxel boxes along the ray from the source (camera origin) through pixel (u, v), in double:
/// Siddon 1985. Dimensionless (1/mm · mm). The source may lie inside the volume. The ray ends at infinity.
double referenceLineIntegral(const AttenuationVolume& volume, const RigidTransform& T_camera_ct,
                             const XrayCamera& camera, double u, double v);

/// A whole image of them, over all host threads. Used by the simulator and by tests, and by nothing that registers.
FloatImage referenceProjection(const AttenuationVolume& volume, const RigidTransform& T_camera_ct,
                               const XrayCamera& camera, int samples_per_pixel_axis = 1);

}  // namespace xray_registration
