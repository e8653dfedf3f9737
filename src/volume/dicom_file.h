#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "file_image.h"

namespace xray_registration {

/// What a DICOM file says about its place in a series; no patient data.
struct DicomSlice {
  std::string path;
  std::string series_uid;
  std::string instance_uid;
  std::string modality;
  std::string rescale_type;  ///< What the values are after rescaling; empty or HU for Hounsfield units.
  int columns = 0;
  int rows = 0;
  int frames = 1;
  int components = 1;
  bool has_geometry = false;      ///< Position, orientation and pixel spacing are stated.
  bool has_value_table = false;   ///< A Modality LUT in place of slope and intercept.
  std::uint64_t image_bytes = 0;  ///< Of the file, up to the end of its pixels.
  bool has_room = true;           ///< The file is long enough for the pixels that it states.
  std::array<double, 3> position_mm{};
  std::array<double, 3> along_row{};     ///< Direction of increasing column.
  std::array<double, 3> along_column{};  ///< Direction of increasing row.
  double column_spacing_mm = 0.0;        ///< Between columns, along a row.
  double row_spacing_mm = 0.0;
  /// Stored values, from and to, that mark pixels outside of what was scanned.
  std::optional<std::pair<int, int>> padding;
};

/// Reads the file up to its pixels. Empty when it is no DICOM image. `is_damaged`: it is DICOM, but cut off or damaged.
std::optional<DicomSlice> readDicomHeader(const std::string& path, bool* is_damaged);

/// Pixels in HU (rescaled), rows × columns; padding becomes air. MONOCHROME1 says how to show them and changes nothing.
/// @throws VolumeError.
void readDicomPixels(const DicomSlice& slice, const FileRule& rule, std::int16_t* hu, ValueFacts* facts);

/// The same for a slice of labels; padding stays as it is.
void readDicomPixels(const DicomSlice& slice, const FileRule& rule, std::uint16_t* labels, ValueFacts* facts);

}  // namespace xray_registration
