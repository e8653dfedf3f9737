#pragma once

#include "xray_registration/image/undistortion_map.h"
#include "xray_registration/image/xray_frame.h"

namespace xray_registration {

/// The camera of a straight image, from its calibration alone: the image has the size that this describes.
/// @throws FrameError as cameraFromCalibration does.
XrayCamera cameraOf(const Calibration& calibration);

/// Where the straight image, which is registered, shows what the raw one has at `raw`: a pixel that somebody has
/// clicked. Both are pixels of the frame, ROI and binning applied; integers are pixel centres.
/// @param map  Null for a detector without distortion of its own.
/// @throws FrameError as cameraOf does.
Eigen::Vector2d straightPixel(const Eigen::Vector2d& raw, const Calibration& calibration,
                              const UndistortionMap* map = nullptr);

}  // namespace xray_registration
