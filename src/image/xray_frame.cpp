#include "xray_registration/image/xray_frame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <utility>

#include "image/sensor_pixels.h"

namespace xray_registration {
namespace {

constexpr std::uint8_t kUse = 255;
constexpr double kSmallestTransmission = 1e-5;
constexpr double kFullScaleAttenuation = 8.0;

cv::Mat wrap(FloatImage* image) { return cv::Mat(image->height, image->width, CV_32F, image->pixels.data()); }

bool isKnown(double saturation_value) { return std::isfinite(saturation_value) && saturation_value > 0.0; }

/// Pixels that one thread works through while they are in its cache.
constexpr std::size_t kBand = 65536;

/// Calls work(first pixel, their number) for bands of an image, side by side.
template <typename Work>
void forBands(const FloatImage& image, const Work& work) {
  const std::size_t pixels = image.pixels.size();
  cv::parallel_for_({0, static_cast<int>((pixels + kBand - 1) / kBand)}, [&](const cv::Range& range) {
    for (int band = range.start; band < range.end; ++band) {
      const std::size_t first = static_cast<std::size_t>(band) * kBand;
      work(first, std::min(kBand, pixels - first));
    }
  });
}

struct PixelSpan {
  std::size_t not_finite = 0;
  float smallest = std::numeric_limits<float>::max();
  float largest = std::numeric_limits<float>::lowest();
};

PixelSpan spanOf(const FloatImage& image) {
  PixelSpan span;
  std::mutex mutex;
  auto* image_data = const_cast<float*>(image.pixels.data());  // As cv::Mat takes what it only reads.
  forBands(image, [&](std::size_t first, std::size_t count) {
    const float* pixels = image_data + first;
    int not_finite = 0;
    // Without branches, for vector instructions; false of NaN.
    for (std::size_t i = 0; i < count; ++i) {
      not_finite += std::abs(pixels[i]) <= std::numeric_limits<float>::max() ? 0 : 1;
    }
    double smallest = 0.0;
    double largest = 0.0;
    cv::minMaxIdx(cv::Mat(1, static_cast<int>(count), CV_32F, image_data + first), &smallest, &largest);
    const std::lock_guard<std::mutex> lock(mutex);
    span.not_finite += static_cast<std::size_t>(not_finite);
    span.smallest = std::min(span.smallest, static_cast<float>(smallest));
    span.largest = std::max(span.largest, static_cast<float>(largest));
  });
  return span;
}

/// @returns the largest value. @throws FrameError for pixels that carry no picture.
float checkPixels(const FloatImage& raw) {
  if (raw.pixels.size() != static_cast<std::size_t>(raw.width) * static_cast<std::size_t>(raw.height)) {
    throw FrameError("the image's data do not fill its width and height");
  }
  const PixelSpan span = spanOf(raw);
  if (span.not_finite > 0) {
    throw FrameError("the image holds " + std::to_string(span.not_finite) + " pixels that are NaN or infinite");
  }
  if (span.smallest == span.largest) {
    std::ostringstream text;
    text << "the image is constant: every pixel is " << span.smallest << " (is the beam on?)";
    throw FrameError(text.str());
  }
  return span.largest;
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
  const double log_open_field = std::log(open_field);
  forBands(*image, [&](std::size_t first, std::size_t count) {
    cv::Mat pixels(1, static_cast<int>(count), CV_32F, image->pixels.data() + first);
    cv::max(pixels, floor, pixels);
    cv::log(pixels, pixels);
    pixels.convertTo(pixels, CV_32F, -1.0, log_open_field);
  });
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
  cv::remap(wrap(&frame->attenuation), target, wrap(&pixels->source_u), wrap(&pixels->source_v), cv::INTER_LINEAR,
            cv::BORDER_REPLICATE);
  frame->attenuation = std::move(straight);
  frame->mask = pixels->seen;
}

}  // namespace

XrayFrame makeXrayFrame(FloatImage raw, double saturation_value, const Calibration& calibration,
                        const LinearizeOptions& options, StraightenedPixels* pixels,
                        const std::shared_ptr<const UndistortionMap>& map) {
  XrayFrame frame;
  frame.camera = cameraFromCalibration(calibration, raw.width, raw.height);
  if (map) checkSize(*map, calibration);
  frame.attenuation = linearized(std::move(raw), saturation_value, options);
  StraightenedPixels own_pixels;
  if (map || isDistorted(calibration)) {
    undistort(calibration, map, pixels != nullptr ? pixels : &own_pixels, &frame);
  } else {
    frame.mask = MaskImage(frame.attenuation.width, frame.attenuation.height, kUse);
  }
  return frame;
}

}  // namespace xray_registration
