#include <cmath>
#include <sstream>
#include <tuple>

#include "xray_registration/image/xray_frame.h"

namespace xray_registration {
namespace {

/// Skew below this share of the focal length moves no pixel of a 10⁴-pixel image by more than a tenth.
constexpr double kLargestSkew = 1e-5;

template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream text;
  text << "camera_info: ";
  (text << ... << parts);
  throw FrameError(text.str());
}

void checkMatrix(const std::array<double, 9>& k) {
  for (const double entry : k) {
    if (!std::isfinite(entry)) refuse("K holds a value that is not finite; calibrate the camera");
  }
  if (k[0] <= 0.0 || k[4] <= 0.0) {
    refuse("the focal lengths K[0] = ", k[0], " and K[4] = ", k[4], " must be positive; calibrate the camera");
  }
  if (std::abs(k[1]) > kLargestSkew * k[0]) {
    refuse("K[1] = ", k[1], " is a skew, which is not supported; rectify the image first");
  }
  if (k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || std::abs(k[8] - 1.0) > 1e-9) {
    refuse("K is not a camera matrix: its second and third rows must be 0 fy cy and 0 0 1");
  }
}

void checkDistortion(const Calibration& calibration) {
  bool is_zero = true;
  for (const double coefficient : calibration.distortion) {
    if (!std::isfinite(coefficient)) refuse("D holds a value that is not finite");
    is_zero = is_zero && coefficient == 0.0;
  }
  if (is_zero) return;
  const std::string& model = calibration.distortion_model;
  const std::size_t count = calibration.distortion.size();
  const bool plumb_bob = (model.empty() || model == "plumb_bob") && (count == 4 || count == 5);
  const bool rational = model == "rational_polynomial" && (count == 8 || count == 12 || count == 14);
  if (plumb_bob || rational) return;
  refuse("distortion model '", model, "' with ", count,
         " coefficients is not supported; use plumb_bob (4 or 5) or rational_polynomial (8)");
}

struct Window {
  int x, y, width, height;
};

Window roiOf(const Calibration& c) {
  if (c.roi_width == 0 && c.roi_height == 0) return {0, 0, c.width, c.height};
  const bool inside = c.roi_x >= 0 && c.roi_y >= 0 && c.roi_width > 0 && c.roi_height > 0 &&
                      c.roi_x <= c.width - c.roi_width && c.roi_y <= c.height - c.roi_height;
  if (!inside) {
    refuse("the ROI of ", c.roi_width, " × ", c.roi_height, " at (", c.roi_x, ", ", c.roi_y,
           ") does not lie in the sensor of ", c.width, " × ", c.height);
  }
  return {c.roi_x, c.roi_y, c.roi_width, c.roi_height};
}

int binningOf(const char* name, int binning) {
  if (binning < 0) refuse(name, " is ", binning, ", it must not be negative");
  return binning == 0 ? 1 : binning;
}

}  // namespace

bool operator==(const Calibration& a, const Calibration& b) {
  const auto fields = [](const Calibration& c) {
    return std::tie(c.width, c.height, c.k, c.distortion, c.distortion_model, c.binning_x, c.binning_y, c.roi_x,
                    c.roi_y, c.roi_width, c.roi_height);
  };
  return fields(a) == fields(b);
}

XrayCamera cameraFromCalibration(const Calibration& calibration, int image_width, int image_height) {
  if (image_width <= 0 || image_height <= 0) {
    throw FrameError("the image has no pixels (" + std::to_string(image_width) + " × " + std::to_string(image_height) +
                     ")");
  }
  if (calibration.width <= 0 || calibration.height <= 0) {
    refuse("width and height are ", calibration.width, " × ", calibration.height, "; is the camera calibrated?");
  }
  checkMatrix(calibration.k);
  checkDistortion(calibration);
  const Window roi = roiOf(calibration);
  const int binning_x = binningOf("binning_x", calibration.binning_x);
  const int binning_y = binningOf("binning_y", calibration.binning_y);
  XrayCamera camera;
  camera.width = roi.width / binning_x;
  camera.height = roi.height / binning_y;
  if (camera.width != image_width || camera.height != image_height) {
    refuse("it describes an image of ", camera.width, " × ", camera.height,
           " (ROI and binning applied), but the image is ", image_width, " × ", image_height);
  }
  camera.fx = calibration.k[0] / binning_x;
  camera.fy = calibration.k[4] / binning_y;
  // Pixel edges scale; centres lie half a pixel inside.
  camera.cx = (calibration.k[2] - roi.x + 0.5) / binning_x - 0.5;
  camera.cy = (calibration.k[5] - roi.y + 0.5) / binning_y - 0.5;
  return camera;
}

}  // namespace xray_registration
