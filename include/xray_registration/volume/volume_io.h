#pragma once

#include <optional>
#include <string>
#include <vector>

#include "xray_registration/common/log.h"
#include "xray_registration/volume/volume.h"
#include "xray_registration/volume/volume_error.h"

namespace xray_registration {

struct VolumeReadOptions {
  std::string series_uid;   ///< DICOM: the series to take; empty takes the one with most slices and logs the choice.
  std::string directory;    ///< When set, files are only read from below this folder (after resolving links).
  std::string orientation;  ///< Where x, y, z of a file point that does not say, e.g. "RAS"; empty: by its format.
  /// HU = hu_slope · value + hu_intercept, where value is what the file states with its own rescaling. Labels: not
  /// used.
  double hu_slope = 1.0;
  double hu_intercept = 0.0;
  std::optional<double> padding;  ///< This value in the file marks voxels that hold none; they become air.
  double unit_mm = 0.0;           ///< Millimetres of the file's unit of length; 0: as the file says.
  bool check_values = true;       ///< Refuse what cannot be Hounsfield units; false: only warn of it.
};

/// Whether they are three letters that a VolumeReadOptions' orientation may hold: one each of L or R, P or A, S or I.
bool isOrientation(const std::string& letters);

/// Reads a NIfTI, NRRD or MetaImage file or a DICOM folder into HU. The frame is LPS as the file states it (NIfTI's RAS
/// is converted); nothing is recentred or resampled, the axes may be oblique or left-handed. Rescale slope and
/// intercept are applied; values are rounded and clamped to 16 bits, what is not a number and what lies outside of the
/// scanned field (padding) becomes air. A DICOM folder is searched with its subfolders; its slices are ordered along
/// their normal. What a file leaves open or contradicts is taken by the rules of docs/ct_files.md, with a warning; what
/// was understood is said at level info. Blocks; call it from one thread at a time.
/// @throws VolumeError for a missing or unreadable file, one that is shorter than its header says, missing slices,
/// uneven spacing, gantry tilt, a single slice, several volumes in one series, more than three dimensions, colour or
/// vector pixels, an unknown series, an empty folder, a path (or a file that it refers to) outside `directory`, a voxel
/// size of zero, values that cannot be Hounsfield units.
Volume readVolume(const std::string& path, const VolumeReadOptions& options, const Logger& logger);

/// Reads a label image in any of the same formats, with the same errors; 3D Slicer's segmentations (.seg.nrrd) as well.
/// @throws VolumeError also when their segments overlap.
LabelVolume readLabels(const std::string& path, const VolumeReadOptions& options, const Logger& logger);

/// Writes .nii, .nii.gz, .nrrd, .mha.
/// @throws VolumeError when the file cannot be written.
void writeVolume(const Volume& volume, const std::string& path);

/// A DICOM series of images in a folder.
struct SeriesInfo {
  std::string uid;
  std::size_t slices = 0;
};

/// The series in a folder and its subfolders, in the order of their UIDs.
std::vector<SeriesInfo> listDicomSeries(const std::string& folder);

}  // namespace xray_registration
