#pragma once

#include <cstddef>

#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// A CT averaged over whole blocks until it has no more than `max_voxels`: enough for a picture of its bones, and a
/// bound on the time that the picture takes.
Volume reducedForDisplay(const Volume& ct, std::size_t max_voxels);

}  // namespace xray_registration
