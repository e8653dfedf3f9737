#include "file_boundary.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "header_text.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void refuse(const fs::path& path, const std::string& what) {
  throw VolumeError("'" + path.string() + "': " + what);
}

bool isBelow(const fs::path& path, const fs::path& directory) {
  const auto mismatch = std::mismatch(directory.begin(), directory.end(), path.begin(), path.end());
  return mismatch.first == directory.end();
}

fs::path resolved(const fs::path& path) {
  std::error_code error;
  fs::path result = fs::weakly_canonical(path, error);
  if (error) refuse(path, "it cannot be resolved: " + error.message());
  return result;
}

void checkBelow(const fs::path& path, const fs::path& directory) {
  if (!isBelow(resolved(path), directory)) {
    refuse(path, "it lies outside ct/directory '" + directory.string() + "', the only place that CTs are read from");
  }
}

void checkReferences(const fs::path& file, const fs::path& directory) {
  const std::string extension = lowerCase(file.extension().string());
  if (extension == ".hdr" || extension == ".img") {
    for (const char* other : {".hdr", ".img"}) checkBelow(fs::path(file).replace_extension(other), directory);
  }
  if (extension != ".mhd" && extension != ".mha" && extension != ".nhdr" && extension != ".nrrd") return;
  const std::string data = headerField(file.string(), {"elementdatafile", "datafile"}).value;
  if (data.empty() || lowerCase(data) == "local") return;
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
  // The system's calls would see another path than these checks.
  if (path.find('\0') != std::string::npos) refuse(path, "a path cannot hold a zero byte");
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
    const fs::directory_iterator readable(real, error);
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

void checkReferred(const std::string& path, const std::string& referred, const std::string& directory) {
  if (directory.empty()) return;
  const fs::path boundary = resolved(directory);
  if (isBelow(resolved(referred), boundary)) return;
  refuse(path, "it refers to '" + referred + "', which lies outside ct/directory '" + boundary.string() + "'");
}

}  // namespace xray_registration
