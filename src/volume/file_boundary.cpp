#include "file_boundary.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxHeaderLines = 10000;

[[noreturn]] void refuse(const fs::path& path, const std::string& what) {
  throw VolumeError("'" + path.string() + "': " + what);
}

bool isBelow(const fs::path& path, const fs::path& directory) {
  const auto mismatch = std::mismatch(directory.begin(), directory.end(), path.begin(), path.end());
  return mismatch.first == directory.end();
}

fs::path resolved(const fs::path& path) {
  std::error_code error;
  const fs::path result = fs::weakly_canonical(path, error);
  if (error) refuse(path, "it cannot be resolved: " + error.message());
  return result;
}

void checkBelow(const fs::path& path, const fs::path& directory) {
  if (!isBelow(resolved(path), directory)) {
    refuse(path, "it lies outside ct/directory '" + directory.string() + "', the only place that CTs are read from");
  }
}

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

// The value of a MetaImage's or NRRD's line that names where the voxels are; empty when they follow the header.
std::string dataFileOf(const fs::path& header) {
  std::ifstream stream(header);
  std::string line;
  for (int i = 0; i < kMaxHeaderLines && std::getline(stream, line) && line.size() < 4096; ++i) {
    const std::size_t divider = line.find_first_of("=:");
    if (divider == std::string::npos) {
      if (line.empty() || line == "\r") break;  // The end of an NRRD header.
      continue;
    }
    std::string key;
    for (const char c : line.substr(0, divider)) {
      if (c != ' ' && c != '\t') key += c;
    }
    key = lowerCase(key);
    if (key != "elementdatafile" && key != "datafile") continue;
    std::istringstream value(line.substr(divider + 1));
    std::string name;
    std::getline(value >> std::ws, name);
    while (!name.empty() && std::isspace(static_cast<unsigned char>(name.back())) != 0) name.pop_back();
    return lowerCase(name) == "local" ? "" : name;
  }
  return "";
}

void checkReferences(const fs::path& file, const fs::path& directory) {
  const std::string extension = lowerCase(file.extension().string());
  if (extension == ".hdr" || extension == ".img") {
    for (const char* other : {".hdr", ".img"}) checkBelow(fs::path(file).replace_extension(other), directory);
  }
  if (extension != ".mhd" && extension != ".mha" && extension != ".nhdr" && extension != ".nrrd") return;
  const std::string data = dataFileOf(file);
  if (data.empty()) return;
  if (lowerCase(data).rfind("list", 0) == 0 || data.find('%') != std::string::npos) {
    refuse(file, "it refers to a list of files, which is not read while ct/directory is set");
  }
  checkBelow(file.parent_path() / data, directory);
}

void checkFolder(const fs::path& folder, const fs::path& directory) {
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->is_symlink()) checkBelow(entry->path(), directory);
  }
}

}  // namespace

std::string checkedPath(const std::string& path, const std::string& directory) {
  if (path.empty()) throw VolumeError("ct/path is empty: name a NIfTI, NRRD or MetaImage file or a DICOM folder");
  fs::path boundary;
  if (!directory.empty()) {
    std::error_code error;
    boundary = fs::canonical(directory, error);
    if (error) refuse(directory, "ct/directory cannot be used: " + error.message());
    checkBelow(path, boundary);
  }
  const fs::path real = resolved(path);
  std::error_code error;
  const fs::file_status status = fs::status(real, error);
  if (!fs::exists(status)) refuse(path, "there is no such file or folder");
  if (fs::is_directory(status)) {
    fs::directory_iterator(real, error);
    if (error) refuse(path, "the folder cannot be opened: " + error.message());
    if (!boundary.empty()) checkFolder(real, boundary);
    return real.string();
  }
  if (!fs::is_regular_file(status)) refuse(path, "it is neither a file nor a folder");
  if (!std::ifstream(real)) refuse(path, "the file cannot be opened; are you allowed to read it?");
  if (fs::file_size(real, error) == 0) refuse(path, "the file is empty");
  if (!boundary.empty()) checkReferences(real, boundary);
  return real.string();
}

}  // namespace xray_registration
