#pragma once

#include "xray_registration/drr/engine.h"

namespace xray_registration {

/// Renders a small scene on the device and by the exact ray tracer on the host, along each axis, and checks the
/// objective's gradient for sanity. Replaces the engine's volume: call it before the real one is set.
/// @throws DeviceError when the device disagrees: a wrong picture must never pass in silence.
void selfTest(Engine* engine);

}  // namespace xray_registration
