#include "image/linearisation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <opencv2/core.hpp>
#include <sstream>
#include <string>
#include <utility>

#include "image/open_field.h"

namespace xray_registration {
namespace {

constexpr double kSmallestTransmission = 1e-5;
constexpr double kFullScaleAttenuation = 8.0;

bool isKnown(double saturation_value) { return std::isfinite(saturation_value) && saturation_value > 0.0; }

/// Calls work(first pixel, their number) for bands of an image, side by side.
template <typename Work>
void forBands(std::size_t pixels, const Work& work) {
  constexpr std::size_t kBand = 65536;  // What one thread works through while it is in its cache.
  cv::parallel_for_({0, static_cast<int>((pixels + kBand - 1) / kBand)}, [&](const cv::Range& range) {
    for (int band = range.start; band < range.end; ++band) {
      const std::size_t first = static_cast<std::size_t>(band) * kBand;
      work(first, std::min(kBand, pixels - first));
    }
  });
}

struct PixelSpan {
  std::size_t not_finite = 0;
  double smallest = std::numeric_limits<double>::max();
  double largest = std::numeric_limits<double>::lowest();
};

std::size_t notFinite(const float* pixels, std::size_t count) {
  int not_finite = 0;
  // Without branches, for vector instructions; false of NaN.
  for (std::size_t i = 0; i < count; ++i) {
    not_finite += std::abs(pixels[i]) <= std::numeric_limits<float>::max() ? 0 : 1;
  }
  return static_cast<std::size_t>(not_finite);
}
std::size_t notFinite(const std::uint16_t* /*pixels*/, std::size_t /*count*/) { return 0; }

template <typename Pixel>
PixelSpan spanOf(const Image<Pixel>& image) {
  PixelSpan span;
  std::mutex mutex;
  auto* all = const_cast<Pixel*>(image.pixels.data());  // As cv::Mat takes what it only reads.
  forBands(image.pixels.size(), [&](std::size_t first, std::size_t count) {
    const std::size_t not_finite = notFinite(all + first, count);
    double smallest = 0.0;
    double largest = 0.0;
    cv::minMaxIdx(cv::Mat(1, static_cast<int>(count), cv::DataType<Pixel>::type, all + first), &smallest, &largest);
    const std::lock_guard<std::mutex> lock(mutex);
    span.not_finite += not_finite;
    span.smallest = std::min(span.smallest, smallest);
    span.largest = std::max(span.largest, largest);
  });
  return span;
}

/// @throws FrameError for pixels that carry no picture.
template <typename Pixel>
PixelSpan checkedSpan(const Image<Pixel>& raw) {
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
  return span;
}

/// Smallest 2ⁿ − 1 (n ≥ 8) that holds the image, for integer encodings; the largest value for floats.
double fullScale(double largest, double saturation_value) {
  if (!isKnown(saturation_value)) return largest;
  double scale = 255.0;
  while (scale < largest) scale = 2.0 * scale + 1.0;
  return std::min(scale, std::max<double>(saturation_value, largest));
}

/// What makes attenuation of values: a line, and −log where that is a transmission.
struct Linearisation {
  double scale = 1.0;
  double offset = 0.0;
  bool takes_logarithm = false;
  double floor = 0.0;  ///< Least transmission.
  double log_open_field = 0.0;

  void alongLine(cv::Mat* values) const {
    if (scale != 1.0 || offset != 0.0) values->convertTo(*values, CV_32F, scale, offset);
  }

  void apply(float* first, std::size_t count) const {
    cv::Mat values(1, static_cast<int>(count), CV_32F, first);
    alongLine(&values);
    if (!takes_logarithm) return;
    cv::max(values, floor, values);
    cv::log(values, values);
    values.convertTo(values, CV_32F, -1.0, log_open_field);
  }
};

/// Sets what the logarithm needs. `samples` are raw values.
void useLogarithm(double saturation_value, double given_open_field, std::vector<float> samples, Linearisation* line) {
  double open_field = given_open_field;
  if (!(open_field > 0.0)) {
    cv::Mat transmission(1, static_cast<int>(samples.size()), CV_32F, samples.data());
    line->alongLine(&transmission);
    open_field = openFieldOf(samples, saturation_value);
  }
  if (!(open_field > 0.0)) {
    std::ostringstream text;
    text << "the image's bright pixels are not positive (" << open_field
         << "): no transmission; check image/kind, or give the intensity of the open beam";
    throw FrameError(text.str());
  }
  const double half_a_count = isKnown(saturation_value) ? 0.5 : 0.0;
  line->takes_logarithm = true;
  line->floor = std::max(half_a_count, kSmallestTransmission * open_field);
  line->log_open_field = std::log(open_field);
}

template <typename Pixel>
Linearisation linearisationOf(const Image<Pixel>& raw, const PixelSpan& span, double saturation_value,
                              const LinearizeOptions& options) {
  Linearisation line;
  switch (options.kind) {
    case ImageKind::kAttenuation:
      if (isKnown(saturation_value)) line.scale = kFullScaleAttenuation / fullScale(span.largest, saturation_value);
      return line;
    case ImageKind::kInverted:
      line.scale = -1.0;
      line.offset = fullScale(span.largest, saturation_value);
      // What was black is now the brightest there can be, not a sign of saturation.
      useLogarithm(isKnown(saturation_value) ? saturation_value + 1.0 : 0.0, options.open_field, spreadSamples(raw),
                   &line);
      return line;
    case ImageKind::kTransmission:
      useLogarithm(saturation_value, options.open_field, spreadSamples(raw), &line);
      return line;
  }
  throw FrameError("image/kind has an unknown value");
}

AttenuationImage appliedTo(FloatImage values, const PixelSpan& /*span*/, const Linearisation& line) {
  forBands(values.pixels.size(),
           [&](std::size_t first, std::size_t count) { line.apply(values.pixels.data() + first, count); });
  return AttenuationImage(std::move(values));
}

AttenuationImage appliedTo(CountImage counts, const PixelSpan& span, const Linearisation& line) {
  std::vector<float> worth(static_cast<std::size_t>(span.largest) + 1);
  std::iota(worth.begin(), worth.end(), 0.0F);
  line.apply(worth.data(), worth.size());
  return {std::move(counts), std::move(worth)};
}

}  // namespace

AttenuationImage linearized(RawPixels raw, double saturation_value, const LinearizeOptions& options) {
  if (!std::isfinite(options.open_field) || options.open_field < 0.0) {
    throw FrameError("image/open_field is " + std::to_string(options.open_field) +
                     ", it must be 0 (estimate) or positive");
  }
  const auto of = [&](auto pixels) {
    const PixelSpan span = checkedSpan(pixels);
    const Linearisation line = linearisationOf(pixels, span, saturation_value, options);
    return appliedTo(std::move(pixels), span, line);
  };
  return raw.counts.empty() ? of(std::move(raw.floats)) : of(std::move(raw.counts));
}

}  // namespace xray_registration
