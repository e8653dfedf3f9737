#pragma once

#include <algorithm>
#include <cctype>
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

/// The text with spaces in place of line breaks and other control characters, so that it is one line of a log.
inline std::string onOneLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  return text;
}

}  // namespace xray_registration
