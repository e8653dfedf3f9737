#pragma once

#include <optional>

#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// Where the voxels of a CT lie on the scale of Hounsfield units. Of about four million of them, evenly taken.
struct HuLandmarks {
  int low_hu = 0;                     ///< A thousandth of the voxels lies below it,
  int high_hu = 0;                    ///< and a thousandth above.
  double air_share = 0.0;             ///< -1150 to -850 HU.
  double soft_tissue_share = 0.0;     ///< -200 to 200 HU.
  double bone_share = 0.0;            ///< 200 to 2500 HU.
  double metal_share = 0.0;           ///< Above 2500 HU.
  std::optional<int> air_hu;          ///< The most frequent value between -1150 and -850, if any is there.
  std::optional<int> soft_tissue_hu;  ///< The same between -200 and 200.
};

/// Any thread.
HuLandmarks huLandmarks(const Volume& ct);

}  // namespace xray_registration
