#pragma once

#include <cstdio>
#include <string>

namespace xray_registration::tools {

/// What a ROS node is asked on its command line before it looks for a master. Prints `text` and returns true for --help
/// and -h; whatever else stands there is roscpp's.
inline bool saidHelp(int argc, const char* const* argv, const char* text) {
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument != "--help" && argument != "-h") continue;
    std::fputs(text, stdout);
    return true;
  }
  return false;
}

}  // namespace xray_registration::tools
