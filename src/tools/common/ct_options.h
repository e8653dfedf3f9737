#pragma once

#include "tools/common/command_line.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration::tools {

/// Options that say how the numbers and lengths of a CT are to be understood: the parameters ct/series_uid,
/// ct/hu_slope, ct/hu_intercept, ct/padding, ct/check_values, ct/orientation and ct/unit_mm, for tools that read no
/// parameters.
void addCtReadOptions(CLI::App& app, VolumeReadOptions* options);

}  // namespace xray_registration::tools
