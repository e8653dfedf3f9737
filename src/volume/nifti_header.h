#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "file_image.h"
#include "value_conversion.h"

namespace xray_registration {

/// What the header of a NIfTI-1 or NIfTI-2 file says. docs/ct_files.md has the rules by which it is understood.
struct NiftiHeader {
  int version = 1;
  bool swap = false;      ///< The other byte order.
  bool detached = false;  ///< The voxels lie in a file of their own.
  std::int32_t datatype = 0;
  std::size_t bytes_per_voxel = 0;
  std::size_t data_offset = 0;
  StoredScale scale;
  FileGrid grid;
  std::string orientation;  ///< Where it was found, in words.
  std::vector<std::string> warnings;
};

constexpr std::size_t kNiftiHeaderBytes = 348;  ///< Of NIfTI-1, and what is needed to know which one it is.
constexpr std::size_t kNifti2HeaderBytes = 540;

/// Bytes of the header that begins so: 348 or 540; 0 when these bytes begin no NIfTI or Analyze file.
std::size_t niftiHeaderBytes(const std::vector<char>& first_bytes);

/// @throws VolumeError naming the file when it is no single volume with one number per voxel, is an Analyze file (which
/// states no frame), or its numbers contradict themselves.
NiftiHeader parsedNiftiHeader(const std::vector<char>& bytes, const FileRule& rule, const std::string& path);

}  // namespace xray_registration
