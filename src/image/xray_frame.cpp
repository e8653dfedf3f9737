#include "xray_registration/image/xray_frame.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <utility>

#include "image/linearisation.h"
#include "image/sensor_pixels.h"

namespace xray_registration {
namespace {

constexpr std::uint8_t kUse = 255;

cv::Mat wrap(FloatImage* image) { return cv::Mat(image->height, image->width, CV_32F, image->pixels.data()); }

bool isDistorted(const Calibration& calibration) {
  return std::any_of(calibration.distortion.begin(), calibration.distortion.end(), [](double d) { return d != 0.0; });
}

/// The pixel of the detector's straight picture that each of the frame's pixels shows: the lens alone.
void throughLens(const XrayCamera& camera, const std::vector<double>& distortion, StraightenedPixels* pixels) {
  const cv::Matx33d k(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
  cv::Mat map_u = wrap(&pixels->source_u);
  cv::Mat map_v = wrap(&pixels->source_v);
  cv::initUndistortRectifyMap(k, distortion, cv::noArray(), k, map_u.size(), CV_32FC1, map_u, map_v);
}

/// Goes on from the detector's straight picture to its raw one.
void throughDetector(const UndistortionMap& map, const Calibration& calibration, StraightenedPixels* pixels) {
  const SensorPixels window(calibration);
  for (std::size_t i = 0; i < pixels->seen.pixels.size(); ++i) {
    const Eigen::Vector2d straight = window.sensor({pixels->source_u.pixels[i], pixels->source_v.pixels[i]});
    const Eigen::Vector2d raw = window.frame(map.rawPixel(straight));
    pixels->source_u.pixels[i] = static_cast<float>(raw.x());
    pixels->source_v.pixels[i] = static_cast<float>(raw.y());
    if (!map.covers(straight)) pixels->seen.pixels[i] = 0;
  }
}

void leaveOutUnseen(const XrayCamera& camera, StraightenedPixels* pixels) {
  for (std::size_t i = 0; i < pixels->seen.pixels.size(); ++i) {
    const float u = pixels->source_u.pixels[i];
    const float v = pixels->source_v.pixels[i];
    // Written so that NaN is outside.
    const bool inside = u >= 0.0F && u <= static_cast<float>(camera.width - 1) && v >= 0.0F &&
                        v <= static_cast<float>(camera.height - 1);
    if (!inside) pixels->seen.pixels[i] = 0;
  }
}

StraightenedPixels pixelsFor(const XrayCamera& camera, const Calibration& calibration,
                             const std::shared_ptr<const UndistortionMap>& map) {
  StraightenedPixels pixels{calibration, map, FloatImage(camera.width, camera.height),
                            FloatImage(camera.width, camera.height), MaskImage(camera.width, camera.height, kUse)};
  throughLens(camera, calibration.distortion, &pixels);
  if (map) throughDetector(*map, calibration, &pixels);
  leaveOutUnseen(camera, &pixels);
  return pixels;
}

void checkSize(const UndistortionMap& map, const Calibration& calibration) {
  if (map.width() == calibration.width && map.height() == calibration.height) return;
  std::ostringstream text;
  text << "the sensor is " << calibration.width << " × " << calibration.height
       << " by its camera_info, but its undistortion map (image/undistortion_map) is for " << map.width() << " × "
       << map.height();
  throw FrameError(text.str());
}

/// Straightens the image; the mask loses the pixels that no raw pixel stands behind.
void undistort(const Calibration& calibration, const std::shared_ptr<const UndistortionMap>& map,
               StraightenedPixels* pixels, XrayFrame* frame) {
  const XrayCamera& camera = frame->camera;
  if (pixels->calibration != calibration || pixels->map != map) *pixels = pixelsFor(camera, calibration, map);
  FloatImage straight(camera.width, camera.height);
  cv::Mat target = wrap(&straight);
  // Attenuation is interpolated, not counts, so these are written out.
  cv::remap(wrap(&frame->attenuation.floats()), target, wrap(&pixels->source_u), wrap(&pixels->source_v),
            cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  frame->attenuation = std::move(straight);
  frame->mask = pixels->seen;
}

}  // namespace

XrayFrame makeXrayFrame(RawPixels raw, double saturation_value, const Calibration& calibration,
                        const LinearizeOptions& options, StraightenedPixels* pixels,
                        const std::shared_ptr<const UndistortionMap>& map) {
  XrayFrame frame;
  frame.camera = cameraFromCalibration(calibration, raw.width(), raw.height());
  if (map) checkSize(*map, calibration);
  frame.attenuation = linearized(std::move(raw), saturation_value, options);
  StraightenedPixels own_pixels;
  if (map || isDistorted(calibration)) {
    undistort(calibration, map, pixels != nullptr ? pixels : &own_pixels, &frame);
  } else {
    frame.mask = MaskImage(frame.camera.width, frame.camera.height, kUse);
  }
  return frame;
}

}  // namespace xray_registration
