#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "xray_registration/image/image.h"

namespace xray_registration {

/// A run of X-rays from one place of a C-arm, as an angiography system stores it. The isocentre is in the middle of the
/// picture.
struct XrayAngiogram {
  std::vector<Image<std::uint16_t>> frames;  ///< Intensities as seen from the detector, the patient's head on top.
  int bits = 16;                             ///< That the values need.
  double frame_time_s = 0.0;                 ///< From one frame to the next.
  double pixel_mm = 0.0;                     ///< On the detector.
  double source_detector_mm = 0.0;
  double source_isocentre_mm = 0.0;
  double primary_deg = 0.0;  ///< As in positionerAxes.
  double secondary_deg = 0.0;
  double collimator_radius_px = 0.0;  ///< Of a round collimator about the middle; 0: none.
  int number = 1;                     ///< In the series.
};

/// Writes it as a DICOM file of the XA kind (X-Ray Angiographic Image Storage), uncompressed. The patient is called
/// SIMULATED.
/// @throws XrayDicomError naming the file when it cannot be written; std::invalid_argument for frames that differ in
/// size, or none.
void writeXrayAngiogram(const std::string& path, const XrayAngiogram& run);

}  // namespace xray_registration
