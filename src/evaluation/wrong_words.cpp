#include "evaluation/wrong_words.h"

#include <cstdlib>
#include <sstream>
#include <stdexcept>

namespace xray_registration {

void refuse(const std::string& message) { throw std::invalid_argument(message); }

Strings splitAt(char separator, const std::string& text) {
  Strings parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) parts.push_back(part);
  return parts;
}

std::string joined(const Strings& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

double number(const std::string& text, const std::string& unit, double lowest, double highest) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  const std::string rest = end;
  if (end == text.c_str() || (!rest.empty() && rest != unit)) {
    refuse("'" + text + "' is no number" + (unit.empty() ? "" : " of " + unit));
  }
  if (value >= lowest && value <= highest) return value;  // Not so for NaN.
  std::ostringstream message;
  message << "'" << text << "' is not between " << lowest << " and " << highest;
  refuse(message.str());
}

bool startsWith(const std::string& start, const std::string& text) { return text.compare(0, start.size(), start) == 0; }

std::uint64_t seedAt(std::size_t position, const Strings& words) {
  if (words.size() <= position) return 1;
  if (!startsWith("seed", words[position])) refuse("'" + words[position] + "' is no seed");
  return static_cast<std::uint64_t>(number(words[position].substr(4), "", 0.0, 1e9));
}

Eigen::Vector3d axisNamed(const std::string& name) {
  const std::size_t axis = std::string("xyz").find(name);
  if (name.size() != 1 || axis == std::string::npos) refuse("'" + name + "' is no axis");
  return Eigen::Vector3d::Unit(static_cast<Eigen::Index>(axis));
}

}  // namespace xray_registration
