#include "header_text.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>

namespace xray_registration {
namespace {

constexpr int kMaxHeaderLines = 10000;
constexpr std::size_t kMaxLineLength = 4096;

std::string withoutBlanks(std::string text) {
  text.erase(std::remove_if(text.begin(), text.end(), [](unsigned char c) { return std::isspace(c) != 0; }),
             text.end());
  return text;
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

}  // namespace

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

HeaderField headerField(const std::string& path, const std::vector<std::string>& keys) {
  std::ifstream stream(path, std::ios::binary);
  std::string line;
  std::size_t position = 0;
  for (int i = 0; i < kMaxHeaderLines && std::getline(stream, line) && line.size() < kMaxLineLength; ++i) {
    position += line.size() + 1;
    if (trimmed(line).empty()) break;  // The end of an NRRD's header.
    const std::size_t divider = line.find_first_of("=:");
    if (divider == std::string::npos) continue;
    const std::string key = lowerCase(withoutBlanks(line.substr(0, divider)));
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) return {trimmed(line.substr(divider + 1)), position};
    if (key == "elementdatafile") break;  // The end of a MetaImage's header.
  }
  return {};
}

}  // namespace xray_registration
