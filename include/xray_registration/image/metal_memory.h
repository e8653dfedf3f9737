#pragma once

#include "xray_registration/image/mask.h"

namespace xray_registration {

/// Where metal was in a view's frames before, kept from frame to frame by whoever makes them: one object per view, one
/// thread at a time. A rod whose outline is sharp in nine tenths of it in one frame and in seven tenths in the next,
/// because bones lie differently behind it, would otherwise be masked in the one and not in the other.
struct MetalMemory {
  MaskImage frames_left;  ///< For how many frames it still counts; on a smaller copy. Empty before the first frame.
};

/// maskFrame for a sequence: what was metal a few frames ago is metal again on less evidence. Null: each frame stands
/// for itself.
/// @throws FrameError as maskFrame does.
void maskFrame(XrayFrame* frame, const MaskOptions& options, const MaskImage& user, MetalMemory* metal);

}  // namespace xray_registration
