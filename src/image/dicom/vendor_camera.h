#pragma once

#include <optional>

#include "xray_registration/image/xray_dicom_geometry.h"

namespace xray_registration::dicom {

/// Camera and pose from the frame's VendorProjection: its 3 × 4 matrix is cut into intrinsics, rotation and source.
/// None when it is no projection onto a detector with axes at right angles, or the size of a pixel is not known.
std::optional<DicomGeometry> vendorGeometry(const DicomHeader& header, const DicomFrame& frame,
                                            const GivenGeometry& given);

}  // namespace xray_registration::dicom
