#include "xray_registration/image/xray_frame.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <utility>

namespace xray_registration {
namespace {

constexpr std::uint8_t kUse = 255;
constexpr double kSmallestTransmission = 1e-5;
constexpr double kFullScaleAttenuation = 8.0;

cv::Mat wrap(FloatImage* image) { return cv::Mat(image->height, image->width, CV_32F, image->pixels.data()); }

bool isKnown(double saturation_value) { return std::isfinite(saturation_value) && saturation_value > 0.0; }

/// @returns the largest value. @throws FrameError for pixels that carry no picture.
float checkPixels(const FloatImage& raw) {
  if (raw.pixels.size() != static_cast<std::size_t>(raw.width) * static_cast<std::size_t>(raw.height)) {
    throw FrameError("the image's data do not fill its width and height");
  }
  const auto bad =
      std::count_if(raw.pixels.begin(), raw.pixels.end(), [](float value) { return !std::isfinite(value); });
  if (bad > 0) {
    throw FrameError("the image holds " + std::to_string(bad) + " pixels that are NaN or infinite");
  }
  const auto [smallest, largest] = std::minmax_element(raw.pixels.begin(), raw.pixels.end());
  if (*smallest == *largest) {
    std::ostringstream text;
    text << "the image is constant: every pixel is " << *smallest << " (is the beam on?)";
    throw FrameError(text.str());
  }
  return *largest;
}

/// Smallest 2ⁿ − 1 (n ≥ 8) that holds the image, for integer encodings; the largest value for floats.
double fullScale(float largest, double saturation_value) {
  if (!isKnown(saturation_value)) return largest;
  double scale = 255.0;
  while (scale < largest) scale = 2.0 * scale + 1.0;
  return std::min(scale, std::max<double>(saturation_value, largest));
}

void takeLogarithm(double saturation_value, double given_open_field, FloatImage* image) {
  const double open_field = given_open_field > 0.0 ? given_open_field : estimateOpenField(*image, saturation_value);
  if (!(open_field > 0.0)) {
    std::ostringstream text;
    text << "the image's bright pixels are not positive (" << open_field
         << "): no transmission; check image/kind, or give the intensity of the open beam";
    throw FrameError(text.str());
  }
  const double half_a_count = isKnown(saturation_value) ? 0.5 : 0.0;
  const double floor = std::max(half_a_count, kSmallestTransmission * open_field);
  cv::Mat pixels = wrap(image);
  cv::max(pixels, floor, pixels);
  cv::log(pixels, pixels);
  pixels.convertTo(pixels, CV_32F, -1.0, std::log(open_field));
}

FloatImage linearized(FloatImage image, double saturation_value, const LinearizeOptions& options) {
  if (!std::isfinite(options.open_field) || options.open_field < 0.0) {
    throw FrameError("image/open_field is " + std::to_string(options.open_field) +
                     ", it must be 0 (estimate) or positive");
  }
  const float largest = checkPixels(image);
  cv::Mat pixels = wrap(&image);
  switch (options.kind) {
    case ImageKind::kAttenuation:
      if (isKnown(saturation_value)) pixels *= kFullScaleAttenuation / fullScale(largest, saturation_value);
      return image;
    case ImageKind::kInverted:
      cv::subtract(fullScale(largest, saturation_value), pixels, pixels);
      // What was black is now the brightest there can be, not a sign of saturation.
      takeLogarithm(isKnown(saturation_value) ? saturation_value + 1.0 : 0.0, options.open_field, &image);
      return image;
    case ImageKind::kTransmission:
      takeLogarithm(saturation_value, options.open_field, &image);
      return image;
  }
  throw FrameError("image/kind has an unknown value");
}

bool isDistorted(const Calibration& calibration) {
  return std::any_of(calibration.distortion.begin(), calibration.distortion.end(), [](double d) { return d != 0.0; });
}

UndistortionMaps mapsFor(const XrayCamera& camera, const std::vector<double>& distortion) {
  UndistortionMaps maps{camera, distortion, FloatImage(camera.width, camera.height),
                        FloatImage(camera.width, camera.height), MaskImage(camera.width, camera.height)};
  const cv::Matx33d k(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
  cv::Mat map_u = wrap(&maps.source_u);
  cv::Mat map_v = wrap(&maps.source_v);
  cv::initUndistortRectifyMap(k, distortion, cv::noArray(), k, map_u.size(), CV_32FC1, map_u, map_v);
  for (std::size_t i = 0; i < maps.seen.pixels.size(); ++i) {
    const float u = maps.source_u.pixels[i];
    const float v = maps.source_v.pixels[i];
    // Written so that NaN is outside.
    const bool inside = u >= 0.0F && u <= static_cast<float>(camera.width - 1) && v >= 0.0F &&
                        v <= static_cast<float>(camera.height - 1);
    maps.seen.pixels[i] = inside ? kUse : 0;
  }
  return maps;
}

/// Straightens the image; the mask loses the pixels that no raw pixel stands behind.
void undistort(const std::vector<double>& distortion, UndistortionMaps* maps, XrayFrame* frame) {
  const XrayCamera& camera = frame->camera;
  if (maps->camera != camera || maps->distortion != distortion) *maps = mapsFor(camera, distortion);
  FloatImage straight(camera.width, camera.height);
  cv::Mat target = wrap(&straight);
  cv::remap(wrap(&frame->attenuation), target, wrap(&maps->source_u), wrap(&maps->source_v), cv::INTER_LINEAR,
            cv::BORDER_REPLICATE);
  frame->attenuation = std::move(straight);
  frame->mask = maps->seen;
}

}  // namespace

XrayFrame makeXrayFrame(FloatImage raw, double saturation_value, const Calibration& calibration,
                        const LinearizeOptions& options, UndistortionMaps* maps) {
  XrayFrame frame;
  frame.camera = cameraFromCalibration(calibration, raw.width, raw.height);
  frame.attenuation = linearized(std::move(raw), saturation_value, options);
  UndistortionMaps own_maps;
  if (isDistorted(calibration)) {
    undistort(calibration.distortion, maps != nullptr ? maps : &own_maps, &frame);
  } else {
    frame.mask = MaskImage(frame.attenuation.width, frame.attenuation.height, kUse);
  }
  return frame;
}

}  // namespace xray_registration
