#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/image.h"

namespace xray_registration {

/// Why a frame cannot be used, in words fit for a status message.
class FrameError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class ImageKind {
  kTransmission,  ///< Detected intensity: bright where little was in the way. −log is taken.
  kAttenuation,   ///< Already −log: bright where much was in the way.
  kInverted,      ///< Display image with bones bright: maximum minus value is a transmission.
};

/// Calibration as a CameraInfo states it, before ROI, binning and distortion are resolved.
struct Calibration {
  int width = 0;   ///< Full sensor, unbinned.
  int height = 0;
  std::array<double, 9> k{};
  std::vector<double> distortion;
  std::string distortion_model;  ///< "plumb_bob", "rational_polynomial", or empty for none.
  int binning_x = 1;
  int binning_y = 1;
  int roi_x = 0;  ///< In unbinned pixels; a ROI of zero size is the whole sensor.
  int roi_y = 0;
  int roi_width = 0;
  int roi_height = 0;
};

struct LinearizeOptions {
  ImageKind kind = ImageKind::kTransmission;
  /// Intensity of the unattenuated beam; 0 estimates it from the image (a high percentile of the unsaturated field).
  double open_field = 0.0;
};

/// One X-ray, ready to be registered.
struct XrayFrame {
  XrayCamera camera;        ///< Undistorted.
  FloatImage attenuation;   ///< −log(I / I0) up to gain and offset: grows with what is in the way. Always finite.
  MaskImage mask;           ///< What may be used: inside collimator and undistorted field, no letters, no metal.
};

/// Checks a calibration against the image it came with and resolves ROI and binning.
/// @throws FrameError for K[0] ≤ 0, a zero size, skew, or a size that disagrees with the image.
XrayCamera cameraFromCalibration(const Calibration& calibration, int image_width, int image_height);

/// Raw pixel values (any integer range, as float) → attenuation, undistorted; mask starts as "the field seen".
/// @throws FrameError when the calibration or the image (constant, not finite) cannot be used.
XrayFrame makeXrayFrame(const FloatImage& raw, double saturation_value, const Calibration& calibration,
                        const LinearizeOptions& options);

}  // namespace xray_registration
