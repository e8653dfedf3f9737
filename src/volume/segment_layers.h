#pragma once

#include <string>

namespace xray_registration {

/// Nothing for a label image whose voxels have one label each.
/// @throws VolumeError naming the file and the remedy when 3D Slicer saved overlapping segments in it, as layers.
void checkLayers(const std::string& path);

}  // namespace xray_registration
