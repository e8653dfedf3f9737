#pragma once

#include "xray_registration/image/xray_dicom_geometry.h"

namespace xray_registration::dicom {

/// Size of a stored pixel on the detector, from the best attribute that there is; says what contradicts it.
Stated<RowColumn> pixelSize(const DicomHeader& header, const DicomFrame& frame, const GivenGeometry& given,
                            std::vector<std::string>* warnings);

/// Where the ray at right angles to the detector meets the stored picture: where the isocentre is projected when the
/// file says so, the middle of a detector whose place in the picture is known, else the middle of the picture.
Stated<Eigen::Vector2d> principalPoint(const DicomHeader& header, const DicomFrame& frame,
                                       const Stated<RowColumn>& pixel_mm, const GivenGeometry& given);

}  // namespace xray_registration::dicom
