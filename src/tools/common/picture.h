#pragma once

#include <string>

namespace xray_registration::tools {

/// Has plot_results, which stands beside the running executable, draw `picture` from a report that was written with
/// --json; `kind` is the first word of its command line.
/// @throws std::runtime_error when it cannot be run or fails; it has said why on standard error.
void drawPicture(const std::string& kind, const std::string& picture, const std::string& report);

}  // namespace xray_registration::tools
