#pragma once

#include <cmath>

#include "test/fuzz/fuzz_target.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration::fuzz {

/// Reads a file as a CT and as labels.
inline void readBoth(const std::string& path) {
  const auto logger = [](LogLevel, const std::string& text) { requireWords(text); };
  const auto check = [](const VolumeGrid& grid, std::size_t voxels) {
    require(grid.voxelCount() == voxels, "there are as many voxels as the grid has");
    require((grid.spacing_mm.array() > 0.0).all() && grid.spacing_mm.allFinite(), "voxels have a size");
    require(grid.origin_ct_mm.allFinite(), "the origin is finite");
    require((grid.direction.transpose() * grid.direction).isIdentity(0.01), "the axes are at right angles");
  };
  try {
    const Volume ct = readVolume(path, {}, logger);
    check(ct.grid, ct.hu.size());
  } catch (const VolumeError& error) {
    requireWords(error.what());
  }
  try {
    const LabelVolume labels = readLabels(path, {}, logger);
    check(labels.grid, labels.labels.size());
  } catch (const VolumeError& error) {
    requireWords(error.what());
  }
}

}  // namespace xray_registration::fuzz
