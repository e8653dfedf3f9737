#pragma once

#include <string>

namespace xray_registration {

/// Whether the elements of a DICOM file lie within it.
struct DicomStructure {
  bool is_dicom = false;     ///< It begins as DICOM does, with or without the preamble.
  bool is_whole = false;     ///< Every element up to the pixels ends within the file and can be walked through.
  bool pixels_fit = false;   ///< So do the pixels, as far as lengths are stated.
  bool is_deflated = false;  ///< Its elements are packed; it is not looked into, and is not whole.
};

/// Walks through the elements of a file without keeping anything. GDCM, as Debian builds it, ends the process on files
/// that are cut off in their header, and takes as much memory as a length claims or as deflated elements unpack to:
/// only files that are whole may be handed to it. Any thread.
DicomStructure dicomStructure(const std::string& path);

}  // namespace xray_registration
