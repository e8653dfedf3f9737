#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace xray_registration {

/// Whether the elements of a DICOM file lie within it.
struct DicomStructure {
  bool is_dicom = false;    ///< It begins as DICOM does, with or without the preamble.
  bool is_whole = false;    ///< Every element up to the pixels ends within the file and can be walked through.
  bool pixels_fit = false;  ///< So do the pixels, as far as lengths are stated.
  /// What the pixels state as their length in bytes; nothing where they are packed in fragments, or there are none.
  std::optional<std::uint32_t> pixel_bytes;
  std::uint64_t header_bytes = 0;  ///< Before the pixels' element, or of the whole file where there are none.
  std::uint64_t image_bytes = 0;   ///< Up to the end of the pixels, where they fit; what follows is padding mostly.
  bool is_deflated = false;        ///< Its elements are packed; it is not looked into, and is not whole.
};

/// Walks through the elements of a file without keeping anything. GDCM, as Debian builds it, ends the process on files
/// that are cut off in their header, and takes as much memory as a length claims or as deflated elements unpack to:
/// only files that are whole may be handed to it. It also reads behind pixels that are fewer than their image has, and
/// does not survive what is no element behind them. Any thread.
DicomStructure dicomStructure(const std::string& path);

/// The first bytes of a file, for GDCM: it takes memory for the pixels' stated length even where it is to stop before
/// them, so that where the header is wanted it had better not see them (header_bytes). Any thread.
std::string dicomBeginning(const std::string& path, std::uint64_t bytes);

}  // namespace xray_registration
