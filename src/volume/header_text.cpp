#include "header_text.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>

#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

constexpr int kMaxHeaderLines = 10000;
constexpr std::size_t kMaxLineLength = std::size_t{1} << 20;

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
  bool is_nrrd = false;
  for (int i = 0; std::getline(stream, line); ++i) {
    // What stands behind would be seen by the library that reads the file, and not here.
    if (i == kMaxHeaderLines || line.size() >= kMaxLineLength) {
      throw VolumeError("'" + path + "': its header is too long to be looked through, or has too long a line");
    }
    position += line.size() + 1;
    if (i == 0) is_nrrd = line.rfind("NRRD", 0) == 0;
    if (is_nrrd && trimmed(line).empty()) break;  // The end of its header; MetaImages may have empty lines.
    const std::size_t divider = line.find_first_of("=:");
    if (divider == std::string::npos) continue;
    const std::string key = lowerCase(withoutBlanks(line.substr(0, divider)));
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) return {trimmed(line.substr(divider + 1)), position};
    if (key == "elementdatafile") break;  // The end of a MetaImage's header.
  }
  return {};
}

}  // namespace xray_registration
