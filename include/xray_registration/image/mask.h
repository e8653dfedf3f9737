#pragma once

#include "xray_registration/image/xray_frame.h"

namespace xray_registration {

struct MaskOptions {
  bool collimator = true;  ///< Find round or polygonal collimators, borders.
  bool letters = true;     ///< Find burned-in letters.
  bool metal = true;       ///< Find what attenuates more, with sharper edges, than anatomy can.
};

// All masks: 255 = use, 0 = leave out; same size as the image; pure functions, any thread. Images with long sides are
// searched on smaller copies. Thresholds are in nepers of attenuation (−log of intensity) and suit display images with
// a gamma as well, where nepers are stretched.

/// Pixels inside the collimated field; the whole image when there is no collimator. Found: one convex or star-shaped
/// aperture (round, polygonal, one shutter or several, an intensifier's disc) that contains the image's centre or the
/// brightest part, with a sharp step to more attenuation and nothing brighter behind it; what a device has drawn around
/// its picture in one value, be that brighter than the beam (a black surround of a video whose bones are white, a white
/// one in transmission), around a disc or outside of a large convex field; and thin frames along the image's borders,
/// dark or drawn in one value. A limb or a dense body that reaches the border is no collimator, nor is air a surround.
MaskImage fieldMask(const AttenuationImage& attenuation);

/// Pixels that are not metal: strong local excess of attenuation with an outline as sharp as the detector (rods,
/// screws, balls, letters of lead up to about a tenth of the image thick), and beads; with a rim for their blur. An
/// empty field means all pixels.
MaskImage metalMask(const AttenuationImage& attenuation, const MaskImage& field);

/// Pixels that are not burned-in letters: thin strokes of exactly the least or largest value on flat ground. Works on
/// raw values and on attenuation. An empty field means all pixels.
MaskImage letterMask(const AttenuationImage& raw, const MaskImage& field);

/// Applies all that `options` names to frame->mask, and `user` (same size; may be empty) on top.
/// @throws FrameError when `user` has another size than the frame.
void maskFrame(XrayFrame* frame, const MaskOptions& options, const MaskImage& user);

}  // namespace xray_registration
