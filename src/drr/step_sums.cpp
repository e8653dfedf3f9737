#include "xray_registration/drr/step_sums.h"

#include <cmath>

namespace xray_registration {

bool StepSums::finite() const { return matrix.allFinite() && gradient.allFinite() && std::isfinite(cost); }

}  // namespace xray_registration
