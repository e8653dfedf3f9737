#pragma once

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/attenuation_image.h"
#include "xray_registration/image/image.h"
#include "xray_registration/image/xray_frame.h"

namespace xray_registration {

/// Mean over factor × factor blocks of the pixels that the mask allows; partial blocks at right and bottom are dropped
/// (XrayCamera::binned describes the result). A block with less than half of its pixels allowed is masked; it still
/// holds a mean, of what is allowed or else of all, so that filters next to it see no hole. An empty mask allows all.
/// @throws std::invalid_argument for a factor below 1 or a mask of another size.
void binImage(const AttenuationImage& image, const MaskImage& mask, int factor, FloatImage* binned,
              MaskImage* binned_mask);
/// The same of a part of the image, in one pass over its pixels as they came.
/// @throws std::invalid_argument for a window that is not inside the image, too.
void binImage(const AttenuationImage& image, const MaskImage& mask, const PixelWindow& window, int factor,
              FloatImage* binned, MaskImage* binned_mask);

/// A frame with its image, mask and camera binned.
XrayFrame binned(const XrayFrame& frame, int factor);

}  // namespace xray_registration
