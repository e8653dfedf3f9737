#include "xray_registration/common/names.h"

#include <algorithm>
#include <cstring>

namespace xray_registration {
namespace {

constexpr std::size_t kLongestName = 100;
constexpr std::size_t kLongestPath = 250;

bool isLetter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

bool isNameCharacter(char c) { return isLetter(c) || (c >= '0' && c <= '9') || c == '_'; }

}  // namespace

bool isName(const std::string& text) {
  return !text.empty() && text.size() <= kLongestName && isLetter(text.front()) &&
         std::all_of(text.begin(), text.end(), isNameCharacter);
}

bool isNamePath(const std::string& text) {
  const std::string parts = text.substr(0, 1) == "/" ? text.substr(1) : text;
  if (parts.empty() || text.size() > kLongestPath || !isLetter(parts.front()) || parts.back() == '/') return false;
  return parts.find("//") == std::string::npos &&
         std::all_of(parts.begin(), parts.end(), [](char c) { return isNameCharacter(c) || c == '/'; });
}

std::string asFileName(std::string name_path) {
  std::replace(name_path.begin(), name_path.end(), '/', '_');
  return name_path;
}

bool isFrameName(const std::string& text) {
  return !text.empty() && text.size() <= kLongestPath && std::all_of(text.begin(), text.end(), [](char c) {
    return c != '\0' && (isNameCharacter(c) || std::strchr("-.:/", c) != nullptr);
  });
}

}  // namespace xray_registration
