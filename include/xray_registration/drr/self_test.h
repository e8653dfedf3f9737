#pragma once

#include <string>

#include "xray_registration/drr/engine.h"
#include "xray_registration/image/image.h"

namespace xray_registration {

/// Compares a picture that a device rendered with the right one.
/// @param tolerance  Largest difference of a pixel that is borne, as a share of the reference's largest value.
/// @throws DeviceError with the device's name when any pixel is further off or not finite, or the sizes differ: a wrong
/// picture must never pass in silence.
void checkPicture(const std::string& device, const FloatImage& rendered, const FloatImage& reference, double tolerance);

/// Renders a small scene on the device and by the exact ray tracer on the host, along each axis. Replaces the engine's
/// volume: call it before the real one is set.
/// @throws DeviceError when the pictures disagree.
void selfTest(Engine* engine);

/// Runs every kernel that registration with `similarity` needs once on a small scene: a driver that compiles a kernel
/// when it is first launched does so now, and no frame waits for it. As selfTest(), it replaces the engine's volume.
void warmUp(Engine* engine, Similarity similarity);

}  // namespace xray_registration
