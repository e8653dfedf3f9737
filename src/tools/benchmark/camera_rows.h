#pragma once

#include <memory>
#include <vector>

#include "tools/benchmark/measure.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration::tools {

/// One DRR of a volume at a pose, for each camera of N columns, all in turns: drr/camera/N (the image read back),
/// drr_gradient/camera/N (objective, gradient and Gauss-Newton matrix against an X-ray from 2° and 2 mm off) and
/// drr_derivatives/camera/N (the image and its derivatives by all six, read back). Times of other projects on the same
/// volume, camera and pose stand beside them in docs/performance.md.
std::vector<BenchmarkRow> measureCameras(const std::shared_ptr<Device>& device, const AttenuationVolume& volume,
                                         const std::vector<XrayCamera>& cameras, const RigidTransform& T_camera_ct,
                                         int rounds);

}  // namespace xray_registration::tools
