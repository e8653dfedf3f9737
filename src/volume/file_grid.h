#pragma once

#include <string>

#include "file_image.h"

namespace xray_registration {

/// A frame that a file states its grid in, as three letters: where its axes point, e.g. RAS.
/// @throws VolumeError naming ct/orientation when they are no such letters.
void checkOrientation(const std::string& letters);

/// Carries a grid from the frame of the letters into LPS.
void turnToLps(const std::string& letters, FileGrid* grid);

/// @throws VolumeError when the size is impossible, a spacing is not positive, or the axes are not at right angles.
void checkGrid(const FileGrid& grid, const std::string& path);

/// Lengths in a unit that is `unit_mm` long become mm.
/// @throws VolumeError when the volume would be larger than any patient or too small to be seen.
void scaleLengths(double unit_mm, const std::string& path, FileGrid* grid);

}  // namespace xray_registration
