#pragma once

#include <optional>

#include "image/dicom/data_set.h"
#include "xray_registration/image/xray_dicom.h"

namespace xray_registration::dicom {

/// The projection that medPhoton's ImagingRing and Loop-X write into a private block, "Navigation Registration 1.0" of
/// group 30BB; none when the file has no such block, or one that is no projection of a detector at right angles.
std::optional<VendorProjection> loopXProjection(const DataSet& file);

}  // namespace xray_registration::dicom
