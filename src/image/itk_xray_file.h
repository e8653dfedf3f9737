#pragma once

#include <optional>
#include <string>

#include "xray_registration/image/raw_image.h"

namespace xray_registration {

/// Reads a DICOM file of one frame; empty when the file is no DICOM image.
/// @throws XrayFileError naming the file.
std::optional<RawImage> readXrayDicom(const std::string& path);

}  // namespace xray_registration
