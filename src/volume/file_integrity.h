#pragma once

#include <cstddef>
#include <functional>
#include <string>

// ITK reads some damaged files without a word and fills what is missing with zeros, which in a CT is water.

namespace xray_registration {

/// Looks through all of a NIfTI file. Calls `not_finite` with the voxel's index and value for each that is not a finite
/// number: the NIfTI library replaces those by zero.
/// @throws VolumeError when the file is truncated or damaged, or no NIfTI-1 (Analyze files state no frame).
void scanNifti(const std::string& path, const std::function<void(std::size_t, double)>& not_finite);

/// @throws VolumeError when a MetaImage's data are shorter than its header says. `bytes`: of all voxels, uncompressed.
void checkMetaImage(const std::string& path, std::size_t bytes);

}  // namespace xray_registration
