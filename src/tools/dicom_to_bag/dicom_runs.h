#pragma once

#include <string>
#include <vector>

#include "xray_registration/common/log.h"
#include "xray_registration/image/xray_dicom.h"

namespace xray_registration::tools {

/// One picture of a run: where it is, and when it was taken, after the run's first.
struct DicomPicture {
  std::size_t file = 0;
  std::size_t frame = 0;
  double time_s = 0.0;
};

/// Pictures that one X-ray camera took one after the other: a multi-frame file, or single-frame files of one series
/// from the same place.
struct DicomRun {
  std::string view;  ///< Its name in the bag.
  std::vector<std::string> paths;
  std::vector<XrayDicomFile> files;
  std::vector<DicomPicture> pictures;
  bool times_are_known = false;

  const DicomHeader& header() const { return files.front().header(); }
  const DicomFrame& frame(const DicomPicture& picture) const {
    return files[picture.file].header().frames[picture.frame];
  }
};

/// Reads files, and all files in folders and below, in the order of their paths. In a folder, what is no DICOM image is
/// passed over, with a warning where it is DICOM.
/// @param period_s  Between pictures whose times the files do not state.
/// @throws XrayDicomError when a named file cannot be read, or a folder holds none.
std::vector<DicomRun> readDicomRuns(const std::vector<std::string>& inputs, double period_s, const Logger& logger);

}  // namespace xray_registration::tools
