#pragma once

#include <map>
#include <string>
#include <vector>

#include "dicom_file.h"

namespace xray_registration {

/// DICOM image series by their UID.
using DicomSeriesMap = std::map<std::string, std::vector<DicomSlice>>;

/// The slices of one volume, in the order of increasing position along the normal (row × column direction).
struct DicomStack {
  std::vector<DicomSlice> slices;
  FileGrid grid;
};

/// The same file in two places of a folder counts once: drops slices with the instance UID, place and pixels of
/// another. Returns how many that are no copies share their UID with another, against the standard.
std::size_t dropCopies(std::vector<DicomSlice>* slices);

/// Orders and checks the slices of one series. Scanners round positions to about 0.1 mm; beyond that the positions must
/// lie evenly on a line along the normal.
/// @throws VolumeError naming `where` and the slices' files for missing slices, uneven spacing, gantry tilt, a single
/// slice, slices that differ in size or orientation, several slices in one place, colour, multi-frame and short files.
DicomStack stackedSlices(std::vector<DicomSlice> slices, const std::string& where);

}  // namespace xray_registration
