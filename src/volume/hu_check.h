#pragma once

#include <string>

#include "file_image.h"

namespace xray_registration {

/// What speaks against a CT's numbers being Hounsfield units.
struct HuDoubt {
  std::string what;      ///< With the remedy; empty when they look right.
  bool is_sure = false;  ///< They are something else. Otherwise it may be a CT that was cut out or made by a program.
};

/// Looks at the range of the file's numbers and at the histogram: a CT has air near -1000 HU and tissue near 0. Says
/// nothing of volumes of less than a thousand voxels, whose histogram tells nothing.
HuDoubt doubtAbout(const FileImage<std::int16_t>& image, const FileRule& rule);

}  // namespace xray_registration
