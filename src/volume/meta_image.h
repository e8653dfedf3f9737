#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace xray_registration {

/// Where the voxels of a MetaImage lie. ITK fills what is missing with zeros, which in a CT is water.
struct MetaImageData {
  std::string file;
  std::size_t offset = 0;  ///< Of the first voxel's byte, or of the compressed data.
  bool is_compressed = false;
  bool is_big_endian = false;
};

/// ITK reads numbers without end where a header states less than one dimension. To be called before it reads one.
/// @throws VolumeError when a number of dimensions in it is none.
void checkMetaImageDimensions(const std::string& path);

/// Looks at the header's text. `bytes`: of all voxels, uncompressed.
/// @throws VolumeError when the data cannot be there, or lie in several files.
MetaImageData metaImageData(const std::string& path, std::size_t bytes);

/// What the text of a MetaImage's header leaves open, and its unit of length.
struct MetaImageText {
  double unit_mm = 1.0;
  bool has_orientation = false;
  std::vector<std::string> warnings;
};

/// @throws VolumeError when it states a voxel size of zero, which ITK takes for 1 mm.
MetaImageText metaImageText(const std::string& path);

}  // namespace xray_registration
