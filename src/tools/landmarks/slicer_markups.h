#pragma once

#include <string>
#include <vector>

#include "tools/landmarks/points_file.h"

namespace xray_registration::tools {

/// 3D Slicer's markups: .mrk.json (since version 4.11).
std::vector<FilePoint> readMarkupsJson(const std::string& path);

/// 3D Slicer's fiducials as a table with a header of #-lines: .fcsv.
std::vector<FilePoint> readMarkupsFcsv(const std::string& path);

}  // namespace xray_registration::tools
