#pragma once

#include <cstdint>
#include <vector>

#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// Cells of equal edges around what is denser than a threshold, with two layers of air.
struct SolidCells {
  VolumeGrid grid;
  std::vector<std::uint8_t> is_solid;
};

/// Marks the cells whose centre is denser (interpolated tri-linearly), and those that they enclose. Empty when nothing
/// is.
SolidCells solidCells(const AttenuationVolume& volume, double threshold_per_mm);

/// Share of each cell, in 1/255, that lies deeper than `tolerance_mm` below the solid's surface.
std::vector<std::uint8_t> shareBelowSurface(const SolidCells& cells, double tolerance_mm);

}  // namespace xray_registration
