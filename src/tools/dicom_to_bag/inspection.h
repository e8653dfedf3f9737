#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/dicom_to_bag/dicom_views.h"

namespace xray_registration::tools {

/// Prints a table of what the files of a view say, where each value is from, and what is missing.
void printInspection(const DicomView& view);

/// The same for programs (docs/formats.md).
nlohmann::json inspectionJson(const DicomView& view);

}  // namespace xray_registration::tools
