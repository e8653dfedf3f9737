#pragma once

#include <string>
#include <vector>

#include "file_image.h"

namespace xray_registration {

/// Where the header of an NRRD says that its voxels lie, in LPS and mm.
struct NrrdHeader {
  FileGrid grid;
  std::string orientation;  ///< In words.
  std::vector<std::string> warnings;
};

/// ITK's own reading of it is wrong for LAS and ignores units. Also looks whether the voxels can lie in the file,
/// before memory is taken for them.
/// @throws VolumeError naming the file.
NrrdHeader readNrrdHeader(const std::string& path, const FileRule& rule);

}  // namespace xray_registration
