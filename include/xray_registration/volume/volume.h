#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "xray_registration/geometry/volume_grid.h"

namespace xray_registration {

/// A CT in Hounsfield units, x fastest.
struct Volume {
  VolumeGrid grid;
  std::vector<std::int16_t> hu;
  std::string name;  ///< File or folder name for logs and status; never a patient's name.
};

/// Labels of structures, x fastest; zero is background. Its grid need not be the CT's.
struct LabelVolume {
  VolumeGrid grid;
  std::vector<std::uint16_t> labels;
};

}  // namespace xray_registration
