#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "xray_registration/common/log.h"
#include "xray_registration/volume/volume.h"

namespace xray_registration {

/// What is wrong with a CT, where, and what to do; the message names the file or folder.
class VolumeError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct VolumeReadOptions {
  std::string series_uid;  ///< DICOM: the series to take; empty takes the one with most slices and logs the choice.
  std::string directory;   ///< When set, files are only read from below this folder (after resolving links).
};

/// Reads a NIfTI, NRRD or MetaImage file or a DICOM folder into HU. The frame is LPS as the file states it (NIfTI's RAS
/// is converted); nothing is recentred or resampled. Rescale slope and intercept are applied.
/// @throws VolumeError for a missing or unreadable file, missing slices, uneven spacing, gantry tilt, a single slice,
/// colour or vector pixels, an unknown series, a path outside `directory`.
Volume readVolume(const std::string& path, const VolumeReadOptions& options, const Logger& logger);

/// Reads a label image in any of the same formats.
LabelVolume readLabels(const std::string& path, const VolumeReadOptions& options, const Logger& logger);

/// Writes .nii, .nii.gz, .nrrd, .mha.
/// @throws VolumeError when the file cannot be written.
void writeVolume(const Volume& volume, const std::string& path);

struct SeriesInfo {
  std::string uid;
  std::size_t slices = 0;
};
std::vector<SeriesInfo> listDicomSeries(const std::string& folder);

}  // namespace xray_registration
