#pragma once

#include <optional>
#include <string>
#include <vector>

#include "xray_registration/image/xray_dicom_geometry.h"

namespace xray_registration::dicom {

/// Where the stored picture's columns and rows lead: positionerAxes after the field's rotation and flip.
PositionerAxes storedAxes(PositionerAxes axes, double rotation_deg, bool flipped);

/// The turn and flip by quarters of `axes` that fits best to what PatientOrientation says, as {"L", "F"} or {"LP",
/// "F"}. None when it says nothing, or what fits none (more than 45° off).
std::optional<PositionerAxes> axesAlong(const PositionerAxes& axes,
                                        const std::vector<std::string>& patient_orientation);

}  // namespace xray_registration::dicom
