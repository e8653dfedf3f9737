#pragma once

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"

namespace xray_registration {

/// Pixels as a detector, a frame grabber or a display would have spoilt them.

FloatImage mirroredLeftRight(const FloatImage& image);
FloatImage mirroredUpDown(const FloatImage& image);

/// Turned clockwise, as seen with x to the right and y down, by so many quarters; width and height change places for an
/// odd number.
FloatImage turned(const FloatImage& image, int quarters);

/// Bright becomes dark: the smallest and the largest value change places, so that twice is the same again.
FloatImage inverted(const FloatImage& image);

/// The image that a lens with the radial coefficient k1 (plumb_bob) makes of a straight one. What lies outside repeats
/// the border.
/// @throws std::invalid_argument when the image would be folded.
FloatImage radiallyDistorted(const FloatImage& image, const XrayCamera& camera, double k1);

/// The S-shape of an image intensifier in a magnetic field: the image is turned about its centre by an angle that grows
/// with the radius squared; half an image width away from the centre a point moves by `edge_px` (clockwise).
FloatImage sShaped(const FloatImage& image, double edge_px);

}  // namespace xray_registration
