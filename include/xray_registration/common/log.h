#pragma once

#include <functional>
#include <string>

#include "xray_registration/common/escaped.h"

namespace xray_registration {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

/// The core's only way to say something. The ROS library hands one that writes to rosconsole, tools one that writes to
/// standard error. Never called with patient identifiers. May be empty: then nothing is said.
using Logger = std::function<void(LogLevel, const std::string&)>;

/// Says one line. Names of files and texts from messages may stand in it: what would be a line of its own, or an order
/// to a terminal, is escaped here.
inline void log(const Logger& logger, LogLevel level, const std::string& text) {
  if (logger) logger(level, escaped(text));
}

}  // namespace xray_registration
