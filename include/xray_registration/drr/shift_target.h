#pragma once

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"

namespace xray_registration {

/// A small X-ray that DRRs are compared with at all shifts up to `reach` pixels along columns and rows.
struct ShiftTarget {
  XrayCamera camera;
  FloatImage attenuation;
  MaskImage mask;  ///< The image's size; 0: not used.
  int reach = 0;
  /// Compare only where the CT is seen, and only what stands out of the surroundings, a box of this radius, pixels: for
  /// a bone among others. 0: whole images, in which the CT is all that is seen.
  int detail_radius = 0;

  /// Shifts along one axis.
  int shifts() const { return 2 * reach + 1; }
  /// Of the DRRs, which show what lies `reach` beyond the X-ray.
  XrayCamera widened() const;
};

/// The X-ray less the mean over boxes of so many pixels around each, of those that are used.
FloatImage detailOf(const FloatImage& image, const MaskImage& mask, int radius);

}  // namespace xray_registration
