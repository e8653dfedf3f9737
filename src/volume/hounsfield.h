#pragma once

#include <algorithm>

#include "xray_registration/volume/attenuation.h"

namespace xray_registration {

/// Attenuation of one HU value, 1/mm.
inline double attenuationOf(int hu, const AttenuationModel& model) {
  if (hu < model.threshold_hu) return 0.0;
  return std::max(0.0, model.water_per_mm * (1.0 + hu / 1000.0));
}

}  // namespace xray_registration
