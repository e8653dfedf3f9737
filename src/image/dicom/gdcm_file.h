#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "image/dicom/data_set.h"

namespace xray_registration::dicom {

/// How a stored value stands in the bits of a pixel, of which others may hold something else.
struct StoredBits {
  int bytes = 1;  ///< 1 or 2 for a pixel.
  int count = 8;  ///< Of the value.
  int shift = 0;  ///< Of its lowest one.
  bool is_signed = false;

  std::int32_t value(const char* pixel) const;
};

/// Attributes and pixels of a file, decoded.
struct FileContents {
  DataSet attributes;
  std::string transfer_syntax;
  int width = 0;
  int height = 0;
  std::size_t frames = 0;
  StoredBits bits;
  std::vector<char> pixels;  ///< Frame after frame.
};

/// @throws XrayDicomError naming the file.
FileContents readFile(const std::string& path);

}  // namespace xray_registration::dicom
