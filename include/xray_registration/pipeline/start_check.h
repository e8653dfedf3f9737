#pragma once

#include <functional>
#include <string>

#include "xray_registration/geometry/rigid_transform.h"
#include "xray_registration/geometry/volume_grid.h"
#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/registration/registrar.h"

namespace xray_registration {

/// Why a start cannot be right whatever the X-ray shows, in words: the CT would lie behind the source, beside the
/// image, or be a speck in it, as when millimetres are given for metres. Empty for any start from which a search may
/// arrive. `box`: the voxels with tissue in them.
std::string impossibleStart(const RigidTransform& T_camera_ct, const VolumeGrid& box, const XrayCamera& camera);

/// Gives the CT's DRR; empty when it cannot.
using DrrRenderer = std::function<FloatImage(const XrayCamera& camera, const RigidTransform& T_camera_ct)>;

/// Why an X-ray says that a start is turned, in words: as given the CT's DRR does not look like it at all, and turned
/// by a quarter or a half it does. Empty for a start from which a search may arrive, and where neither looks alike.
/// Renders one small DRR when the start is good, else 24.
/// @param T_camera_ct  In the view's own camera.
std::string turnedStart(const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm, const ViewInput& view,
                        const DrrRenderer& render);

}  // namespace xray_registration
