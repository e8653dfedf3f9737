#pragma once

#include "xray_registration/image/xray_frame.h"

namespace xray_registration {

/// Raw values → attenuation, as makeXrayFrame says. Floats become it in place, counts get a table.
/// @throws FrameError for pixels that carry no picture.
AttenuationImage linearized(RawPixels raw, double saturation_value, const LinearizeOptions& options);

}  // namespace xray_registration
