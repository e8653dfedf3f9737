#pragma once

#include <string>

namespace xray_registration {

/// The path with links resolved. When `directory` is not empty, the path and every file that it refers to (a detached
/// header's data, links in a folder) must lie below it.
/// @throws VolumeError when the path does not exist, cannot be opened, is neither a file nor a folder, or lies outside.
std::string checkedPath(const std::string& path, const std::string& directory);

/// The same for a file that is about to be opened because `path` refers to it: what a library, or a reader, understood
/// of a header, which is more than checkedPath() can see. Does nothing when `directory` is empty.
/// @throws VolumeError when it lies outside.
void checkReferred(const std::string& path, const std::string& referred, const std::string& directory);

}  // namespace xray_registration
