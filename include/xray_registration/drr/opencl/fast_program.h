#pragma once

#include <cstddef>
#include <string>

#include "xray_registration/drr/opencl/layout.h"

namespace xray_registration {

/// How the rays of a tile are spread over work-items, and how the voxels stand that they read.
struct MarchShape {
  int lanes = layout::kRays;  ///< Rays of one work-item: all of a tile's on a CPU, 1 on a GPU.
  int split = 1;              ///< Work-items of one ray: 1, 2 or 4; more than 1 only with one lane.
  bool voxels_16 = true;      ///< See hasVoxels16.
  std::size_t itemsPerTile() const {
    return static_cast<std::size_t>(layout::kRays / lanes) * static_cast<std::size_t>(split);
  }
};

/// The fast method's kernels as one text. A build log names the file and the line.
std::string fastSource();

/// What the text is compiled with.
std::string fastOptions(const MarchShape& shape);

}  // namespace xray_registration
