#pragma once

#include <cstdint>

#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// CTs that are not the patient's, or not as the scanner saw him. All keep the grid's centre where it was.

/// Lengths times `factors` along the grid's axes nearest to the patient's x, y and z (LPS); no voxel changes.
Volume scaled(Volume ct, const Eigen::Vector3d& factors);

/// Left and right exchanged: mirrored along the patient's x at the grid's centre. No value is interpolated and the
/// grid's handedness stays.
Volume mirrored(Volume ct);

/// Sheared by `shear` in the patient's x-z plane without turning: what lies d mm from the centre along z moves by
/// shear/2 · d along x, and the other way round.
Volume sheared(const Volume& ct, double shear);

/// Bent smoothly by a sum of sines about as long as the CT: a point of the body (above air) moves by `largest_mm` at
/// most. The part of it that is a rigid motion of the body is left out.
Volume bent(const Volume& ct, double largest_mm, std::uint64_t seed);

/// `ct` shifted to have its grid's centre where `place` has its own.
Volume centredLike(const Volume& place, Volume ct);

}  // namespace xray_registration
