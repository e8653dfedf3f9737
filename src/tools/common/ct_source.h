#pragma once

#include <string>

#include "xray_registration/common/log.h"
#include "xray_registration/volume/phantom.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration::tools {

/// A CT from a file or folder, or one of the project's phantoms.
struct CtSource {
  std::string path;         ///< Wins over the phantom.
  std::string phantom;      ///< "head", "pelvis" or "cube".
  double spacing_mm = 1.0;  ///< Of the phantom.
  VolumeReadOptions read;   ///< Of the file.
};

/// A phantom with its bones apart.
/// @throws ArgumentError as loadCt does, and for the cube, which has no bones.
LabelledPhantom loadLabelledPhantom(const CtSource& source);

/// @throws ArgumentError for an unknown phantom, a spacing out of range, or when nothing is named.
/// @throws VolumeError when the CT cannot be read.
Volume loadCt(const CtSource& source, const Logger& logger);

}  // namespace xray_registration::tools
