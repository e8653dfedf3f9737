#pragma once

#include <string>
#include <vector>

#include "xray_registration/registration/geometry_calibration.h"

namespace xray_registration::tools {

/// Draws a PNG with a row for each view: an X-ray of it with the residual motion before and after as arrows from where
/// the DRR has a piece of the X-ray to where it is, the median over the frames, longer than true by a factor that the
/// caption states.
/// @throws std::runtime_error naming the file when it cannot be written.
void drawResidualMotion(const std::string& path, const std::vector<ViewInput>& xrays,
                        const std::vector<std::string>& names, const GeometryCalibration& found);

}  // namespace xray_registration::tools
