#pragma once

#include <functional>
#include <string>

namespace xray_registration {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

/// The core's only way to say something. The ROS library hands one that writes to rosconsole, tools one that writes to
/// standard error. Never called with patient identifiers. May be empty: then nothing is said.
using Logger = std::function<void(LogLevel, const std::string&)>;

inline void log(const Logger& logger, LogLevel level, const std::string& text) {
  if (logger) logger(level, text);
}

}  // namespace xray_registration
