#pragma once

#include <iomanip>
#include <sstream>
#include <string>

namespace xray_registration {

/// Words and numbers of a reason, three digits each: more would look like knowledge.
template <typename... Parts>
std::string sentence(const Parts&... parts) {
  std::ostringstream text;
  text << std::setprecision(3);
  (text << ... << parts);
  return text.str();
}

}  // namespace xray_registration
