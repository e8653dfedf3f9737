#pragma once

#include "image/dicom/data_set.h"
#include "xray_registration/image/xray_dicom.h"

namespace xray_registration::dicom {

/// What a file's attributes say, but for the size of the pixels.
/// @param frame_count  As the pixels have it.
DicomHeader headerOf(const DataSet& file, std::size_t frame_count);

/// A shutter (tag::kShutter) or collimator (tag::kCollimator).
DicomShutter shutterOf(const Scopes& scopes, Tag base);

}  // namespace xray_registration::dicom
