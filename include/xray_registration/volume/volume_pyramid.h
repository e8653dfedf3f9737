#pragma once

#include <cstddef>
#include <vector>

#include "xray_registration/common/log.h"
#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// The volume averaged over blocks of `factor` voxels per axis (box filter); partial blocks at the high faces average
/// what is there, weighted as if the rest were air unless the face is cut. Origin and spacing follow. Both cores.
AttenuationVolume downsampled(const AttenuationVolume& volume, const Eigen::Vector3i& factor);

/// The levels below `finest`, from fine to coarse; empty for a tiny volume. Each next level halves the axes whose
/// spacing is within a factor 1.5 of the finest spacing first, so that anisotropic CTs become isotropic; ends when
/// every axis has fewer than `min_size` voxels or the spacing passes `max_spacing_mm`.
std::vector<AttenuationVolume> coarserLevels(const AttenuationVolume& finest, int min_size = 24,
                                             double max_spacing_mm = 12.0);

/// Tri-linearly averaged copy with at most `max_bytes` of 16-bit voxels; warns with both sizes when it had to shrink.
AttenuationVolume fittedTo(AttenuationVolume volume, std::size_t max_bytes, const Logger& logger);

}  // namespace xray_registration
