#pragma once

#include "xray_registration/image/xray_frame.h"

namespace xray_registration {

struct MaskOptions {
  bool collimator = true;  ///< Find round or polygonal collimators, borders.
  bool letters = true;     ///< Find burned-in letters.
  bool metal = true;       ///< Find what attenuates more, with sharper edges, than anatomy can.
};

/// Pixels inside the collimated field: the largest region that is neither black border nor flat shutter, by default the
/// whole image. Works on raw values or attenuation.
MaskImage fieldMask(const FloatImage& image);

/// Pixels that are not metal: strong, sharp-edged local excess of attenuation (rods, screws, beads), dilated by a rim.
MaskImage metalMask(const FloatImage& attenuation, const MaskImage& field);

/// Pixels that are not burned-in letters (saturated strokes on flat ground).
MaskImage letterMask(const FloatImage& raw, const MaskImage& field);

/// Applies all that `options` names to frame->mask, and `user` (same size; may be empty) on top.
void maskFrame(XrayFrame* frame, const MaskOptions& options, const MaskImage& user);

}  // namespace xray_registration
