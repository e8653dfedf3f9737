#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "file_image.h"

namespace xray_registration {

/// Reads an NRRD or MetaImage with three dimensions and one number per voxel. Numbers are rounded and clamped to the
/// type; what is not a number becomes air (-1000) or background (0).
/// @throws VolumeError naming the file.
FileImage<std::int16_t> readHuFile(const std::string& path, const FileRule& rule);
FileImage<std::uint16_t> readLabelFile(const std::string& path, const FileRule& rule);

/// Writes by the path's extension. @throws VolumeError.
void writeHuFile(const FileGrid& grid, const std::vector<std::int16_t>& hu, const std::string& path);

}  // namespace xray_registration
