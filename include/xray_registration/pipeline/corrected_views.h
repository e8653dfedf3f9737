#pragma once

#include <vector>

#include "xray_registration/pipeline/frame_maker.h"
#include "xray_registration/registration/geometry_calibration.h"

namespace xray_registration {

/// What was told of a view's camera, corrected. Shifts are in pixels of the image as it comes, K in those of the
/// sensor.
Calibration corrected(Calibration told, const ViewGeometry& geometry);

/// A frame's views with cameras, undistortion and relative poses by a corrected geometry, one for each view.
/// @throws FrameError for a view that cannot be used.
std::vector<ViewInput> correctedViews(std::vector<RawView> told, const std::vector<ViewGeometry>& geometry,
                                      FrameMaker* maker);

/// No corrections, and the relative poses as told.
std::vector<ViewGeometry> toldGeometry(const std::vector<RawView>& views);

}  // namespace xray_registration
