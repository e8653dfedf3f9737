#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "xray_registration/common/escaped.h"
#include "xray_registration/geometry/xray_camera.h"
#include "xray_registration/image/attenuation_image.h"
#include "xray_registration/image/raw_image.h"
#include "xray_registration/image/undistortion_map.h"

namespace xray_registration {

/// Why a frame cannot be used, in words fit for a status message.
class FrameError : public EscapedError {
 public:
  using EscapedError::EscapedError;
};

enum class ImageKind {
  kTransmission,  ///< Detected intensity: bright where little was in the way. −log is taken.
  kAttenuation,   ///< Already −log: bright where much was in the way.
  kInverted,      ///< Display image with bones bright: full scale minus value is a transmission.
};

/// Calibration as a CameraInfo states it, before ROI, binning and distortion are resolved. R and P are not used: the
/// undistorted camera keeps K.
struct Calibration {
  int width = 0;  ///< Full sensor, unbinned.
  int height = 0;
  std::array<double, 9> k{};
  std::vector<double> distortion;
  std::string distortion_model;  ///< "plumb_bob", "rational_polynomial", or empty for none.
  int binning_x = 1;             ///< 0 means 1.
  int binning_y = 1;
  int roi_x = 0;  ///< In unbinned pixels; a ROI of zero size is the whole sensor.
  int roi_y = 0;
  int roi_width = 0;
  int roi_height = 0;
};

bool operator==(const Calibration& a, const Calibration& b);
inline bool operator!=(const Calibration& a, const Calibration& b) { return !(a == b); }

struct LinearizeOptions {
  ImageKind kind = ImageKind::kTransmission;
  /// Intensity of the unattenuated beam in the units of the (for kInverted: inverted) pixels; 0 estimates it from the
  /// image, see estimateOpenField. Not used for kAttenuation.
  double open_field = 0.0;
};

/// One X-ray, ready to be registered.
struct XrayFrame {
  XrayCamera camera;             ///< Undistorted.
  AttenuationImage attenuation;  ///< −log(I / I0) up to gain and offset: grows with what is in the way. Always finite.
  MaskImage mask;                ///< What may be used: inside collimator and undistorted field, no letters, no metal.
};

/// Where the pixels of straightened images come from, kept from frame to frame by whoever makes the frames: one object
/// per view, one thread at a time. Made when a distortion is first met, and anew when the calibration or the map
/// changes.
struct StraightenedPixels {
  Calibration calibration;                     ///< What they were made for,
  std::shared_ptr<const UndistortionMap> map;  ///< with it; null for a detector without distortion of its own.
  FloatImage source_u;                         ///< Column in the raw image, pixels.
  FloatImage source_v;                         ///< Row.
  MaskImage seen;  ///< 0 where the source lies outside of the raw image or the map does not cover it, else 255.
};

/// Checks a calibration against the image it came with and resolves ROI and binning. Pixels of a binned image are means
/// of blocks, so the principal point moves by half a pixel as in XrayCamera::binned.
/// @throws FrameError for K[0] ≤ 0, a zero size, skew, a ROI beyond the sensor, an unknown distortion model, or a size
/// that disagrees with the image.
XrayCamera cameraFromCalibration(const Calibration& calibration, int image_width, int image_height);

/// Intensity of the unattenuated beam: the 99.5th percentile of the pixels below saturation, which moves little from
/// frame to frame; where nearly all pixels are saturated, the saturation. At most 2¹⁶ pixels, evenly spread, are looked
/// at. @param saturation_value  ≤ 0 or infinite when unknown.
double estimateOpenField(const FloatImage& transmission, double saturation_value);

/// Raw pixel values (any integer range) → attenuation, undistorted; mask starts as "the field seen". Counts stay counts
/// where nothing is distorted: what each is worth is worked out once.
///
/// Intensities are floored at half a count or 1e-5 of the open field, whichever is more, so that dead and blocked
/// pixels stay finite. Saturated pixels stay in the mask: they say that (nearly) nothing was in the way. Integer images
/// of kind kAttenuation are scaled so that full scale is 8, near what a true −log of 12 bits has; full scale is the
/// smallest 2ⁿ − 1 that holds the image, as 12-bit detectors fill 16-bit images.
/// @param raw  Moved in, its floats become the attenuation in place.
/// @param saturation_value  Largest value of the encoding (255, 65535); ≤ 0 or infinite when there is none (floats).
/// The detector's own distortion (`map`, of the whole sensor) comes after the lens in the way of the light: the
/// calibration's D describes images that `map` has straightened. Both are undone with one interpolation.
/// @param pixels  Saves finding them for every frame; the result is the same without.
/// @param map  Null for a detector without distortion of its own.
/// @throws FrameError when the calibration or the image (constant, not finite) cannot be used, or `map` is of a sensor
/// of another size.
XrayFrame makeXrayFrame(RawPixels raw, double saturation_value, const Calibration& calibration,
                        const LinearizeOptions& options, StraightenedPixels* pixels = nullptr,
                        const std::shared_ptr<const UndistortionMap>& map = nullptr);

}  // namespace xray_registration
