#pragma once

#include <opencv2/core.hpp>

#include "xray_registration/volume/volume.h"

namespace xray_registration::tools {

/// The planes through the middle of a CT, side by side: axial, coronal, sagittal, as radiologists look at them (the
/// patient's left is on the right of the picture, the head up, the face to the left). Drawn in the patient's axes,
/// however the file has its voxels, with letters for the sides: what is upside down or the wrong way round is seen.
/// Grey from -500 to 1000 HU; what the CT does not cover is blue.
cv::Mat threePlanes(const Volume& ct);

}  // namespace xray_registration::tools
