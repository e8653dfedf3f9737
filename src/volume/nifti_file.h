#pragma once

#include <cstdint>
#include <string>

#include "file_image.h"

namespace xray_registration {

/// Whether the file begins as a NIfTI or Analyze file does, compressed or not, whatever its name.
bool isNifti(const std::string& path);

/// Reads a NIfTI-1 or NIfTI-2 file, compressed or not, in one pass.
/// @throws VolumeError naming the file.
FileImage<std::int16_t> readNiftiHu(const std::string& path, const FileRule& rule);
FileImage<std::uint16_t> readNiftiLabels(const std::string& path, const FileRule& rule);

}  // namespace xray_registration
