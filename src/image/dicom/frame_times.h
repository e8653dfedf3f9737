#pragma once

#include <optional>
#include <string>

#include "image/dicom/data_set.h"
#include "xray_registration/image/xray_dicom.h"

namespace xray_registration::dicom {

/// "HHMMSS.FFFFFF", as much of it as there is; empty when it is no time.
std::optional<double> secondsOfDay(const std::string& time);

/// Sets the frames' times after the first one, and which attribute they are from: what each frame states (enhanced
/// DICOM), the times between frames, the time of all of them, the rate of the cine.
void setFrameTimes(const DataSet& file, DicomHeader* header);

}  // namespace xray_registration::dicom
