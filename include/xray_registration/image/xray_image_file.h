#pragma once

#include <string>

#include "xray_registration/common/escaped.h"
#include "xray_registration/image/raw_image.h"

namespace xray_registration {

/// A file that holds no X-ray image; the message names it.
class XrayFileError : public EscapedError {
 public:
  using EscapedError::EscapedError;
};

/// Reads one X-ray image as the detector gave it: DICOM (the stored values, rescaled as the file says) or what OpenCV
/// reads in 8 or 16 bits or floats (PNG, TIFF, PGM); colours become grey. The largest value of a DICOM file is that of
/// its bits. One call at a time.
/// @throws XrayFileError naming the file when it cannot be read, is cut off, or holds several frames.
RawImage readXrayImage(const std::string& path);

}  // namespace xray_registration
