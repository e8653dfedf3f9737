#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace xray_registration {

std::string lowerCase(std::string text);

/// One "key = value" or "key: value" line of a MetaImage's or NRRD's header; empty value when the key is not there.
struct HeaderField {
  std::string value;
  std::size_t end_of_line = 0;  ///< Where the next line begins, bytes from the start.
};

/// The first line with one of `keys` (lower case, without blanks), up to the end of the header.
/// @throws VolumeError when the header cannot be looked through to its end.
HeaderField headerField(const std::string& path, const std::vector<std::string>& keys);

}  // namespace xray_registration
