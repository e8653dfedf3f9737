#pragma once

#include "xray_registration/image/image.h"

namespace xray_registration {

/// Pixels over which residuals are correlated: in each tile of 8 × 8 pixels that was rendered (values ≥ 0), X-ray minus
/// the DRR with the tile's best gain and offset; from the correlation of neighbours ρ along both axes, as for a
/// first-order process, (1 + ρx)/(1 − ρx) · (1 + ρy)/(1 − ρy). At least 1.
double residualCorrelationArea(const FloatImage& drr, const FloatImage& xray);

}  // namespace xray_registration
