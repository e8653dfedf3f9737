#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "image/mask_common.h"
#include "xray_registration/image/mask.h"

// Burned-in letters have the image's least or largest value exactly, small strokes, and ground around them that is flat
// compared with the step to it. Saturated background has the first mark only: it is large, or its edge is soft.
namespace xray_registration {
namespace {

using mask_detail::kUse;

constexpr float kExtremeShare = 0.004F;  ///< Of the range: what counts as the extreme value itself.
constexpr float kSmallestStep = 0.3F;    ///< From the ground to the letter, share of the range.
constexpr float kFlatness = 0.15F;       ///< Largest standard deviation of the ground, share of the step.
constexpr double kLargestLetter = 0.12;  ///< Height and width, share of the image's longer side.
constexpr double kThickestStroke =
    0.02;  ///< Likewise; the area of a letter is at most its box's circumference times it.
constexpr int kSmallestArea = 3;
constexpr int kRim = 2;

/// Mean and deviation of a component's surroundings, from 2 to 4 pixels away, other extreme pixels left out.
bool groundIsFlat(const cv::Mat& image, const cv::Mat& extreme, const cv::Mat& labels, int label, const cv::Rect& box,
                  float value, float least_step) {
  const cv::Rect area = (box + cv::Size(8, 8) - cv::Point(4, 4)) & cv::Rect({0, 0}, image.size());
  const cv::Mat own = labels(area) == label;
  cv::Mat near_own;
  cv::Mat far_own;
  cv::dilate(own, near_own, cv::Mat::ones(3, 3, CV_8U));
  cv::dilate(own, far_own, cv::Mat::ones(9, 9, CV_8U));
  cv::Mat others;
  cv::dilate(extreme(area), others, cv::Mat::ones(3, 3, CV_8U));
  const cv::Mat ground = far_own & ~near_own & ~others;
  if (cv::countNonZero(ground) < 8) return false;
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(image(area), mean, deviation, ground);
  const double step = std::abs(mean[0] - value);
  return step > least_step && deviation[0] < kFlatness * step;
}

/// Largest of `values` over the pixels of each label but 0.
std::vector<float> largestPerLabel(const cv::Mat& values, const cv::Mat& labels, int count) {
  std::vector<float> largest(static_cast<std::size_t>(count), 0.0F);
  for (int v = 0; v < labels.rows; ++v) {
    const int* label = labels.ptr<int>(v);
    const float* value = values.ptr<float>(v);
    for (int u = 0; u < labels.cols; ++u) {
      if (label[u] == 0) continue;
      float& known = largest[static_cast<std::size_t>(label[u])];
      known = std::max(known, value[u]);
    }
  }
  return largest;
}

/// Marks the letters that are drawn in `value`. `extreme` has the pixels with that value, `steps` the image's range
/// around each pixel.
void findLetters(const cv::Mat& whole_image, const cv::Mat& whole_steps, const cv::Mat& whole_extreme, float value,
                 float least_step, cv::Mat* whole_letters) {
  const cv::Mat at_step = whole_extreme & (whole_steps > least_step);
  if (cv::countNonZero(at_step) < kSmallestArea) return;
  const int longest_side = std::max(whole_image.cols, whole_image.rows);
  // What reaches from a step to the border of this area is too large for a letter; the ground needs four pixels more.
  const cv::Rect area = mask_detail::boxAround(at_step, static_cast<int>(kLargestLetter * longest_side) + 8);
  const cv::Mat image = whole_image(area);
  const cv::Mat extreme = whole_extreme(area);
  cv::Mat letters = (*whole_letters)(area);
  const mask_detail::Parts parts = mask_detail::partsOf(extreme, 8);
  const cv::Mat& labels = parts.labels;
  const int count = static_cast<int>(parts.parts.size());
  const std::vector<float> step = largestPerLabel(whole_steps(area), labels, count);
  const double stroke = std::max(2.0, kThickestStroke * longest_side);
  for (int i = 1; i < count; ++i) {
    const cv::Rect& box = parts.parts[static_cast<std::size_t>(i)].box;
    const int pixels = parts.parts[static_cast<std::size_t>(i)].pixels;
    if (step[static_cast<std::size_t>(i)] < least_step || pixels < kSmallestArea) continue;
    if (std::max(box.width, box.height) > kLargestLetter * longest_side) continue;
    if (pixels > stroke * 2.0 * (box.width + box.height)) continue;
    if (groundIsFlat(image, extreme, labels, i, box, value, least_step)) letters(box).setTo(kUse, labels(box) == i);
  }
}

/// Pixels as they came, and the least and the largest of some of them.
template <typename Pixel>
struct Span {
  Pixel low;
  Pixel high;
};

/// Over the pixels that are allowed; low above high where there are none. Without branches, for vector instructions.
Span<float> spanOf(const FloatImage& image, const std::uint8_t* allowed) {
  Span<float> span{std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()};
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float pixel = image.pixels[i];
    span.low = std::min(span.low, allowed[i] != 0 ? pixel : std::numeric_limits<float>::max());
    span.high = std::max(span.high, allowed[i] != 0 ? pixel : std::numeric_limits<float>::lowest());
  }
  return span;
}

/// The same. The oldest vector instructions order signed numbers alone.
Span<std::uint16_t> spanOf(const CountImage& image, const std::uint8_t* allowed) {
  constexpr int kHalf = 0x8000;
  using Signed = std::int16_t;
  Signed low = std::numeric_limits<Signed>::max();
  Signed high = std::numeric_limits<Signed>::lowest();
  const std::uint16_t* pixels = image.pixels.data();
  const std::size_t count = image.pixels.size();
  for (std::size_t i = 0; i < count; ++i) {
    const auto pixel = static_cast<Signed>(pixels[i] ^ kHalf);
    const auto use = static_cast<Signed>(-static_cast<int>(allowed[i] != 0));
    low = std::min(low, static_cast<Signed>((pixel & use) | (std::numeric_limits<Signed>::max() & ~use)));
    high = std::max(high, static_cast<Signed>((pixel & use) | (std::numeric_limits<Signed>::lowest() & ~use)));
  }
  return {static_cast<std::uint16_t>(low ^ kHalf), static_cast<std::uint16_t>(high ^ kHalf)};
}

/// The part of counts that is worth between two values, at an end of the span; the table goes one way.
Span<std::uint16_t> countsWorth(const std::vector<float>& worth, Span<std::uint16_t> span, const Span<float>& value) {
  const auto is_worth = [&](std::uint16_t count) { return worth[count] >= value.low && worth[count] <= value.high; };
  while (span.low < span.high && !is_worth(span.low)) ++span.low;
  while (span.low < span.high && !is_worth(span.high)) --span.high;
  return span;
}

/// Adds one for each of `cols` pixels that has the value and is allowed. Without branches, for vector instructions.
template <typename Pixel>
void countExtremes(const Pixel* pixels, const std::uint8_t* allowed, int cols, const Span<Pixel>& value,
                   std::uint16_t* count) {
  const Pixel low = value.low;
  const Pixel high = value.high;
  for (int u = 0; u < cols; ++u) {
    count[u] = static_cast<std::uint16_t>(count[u] + ((pixels[u] >= low) & (pixels[u] <= high) & (allowed[u] != 0)));
  }
}

/// Blocks of factor × factor pixels at least a quarter of which have the value and are allowed.
template <typename Pixel>
cv::Mat blocksOf(const Image<Pixel>& image, const std::uint8_t* allowed, const Span<Pixel>& value, int factor,
                 const cv::Size& size) {
  cv::Mat blocks = cv::Mat::zeros(size, CV_8U);
  const int rows = std::min(factor, image.height);
  const int cols = std::min(factor, image.width);
  std::vector<std::uint16_t> counts(static_cast<std::size_t>(image.width));
  std::vector<int> sums(static_cast<std::size_t>(size.width));
  for (int block_v = 0; block_v < size.height; ++block_v) {
    std::fill(counts.begin(), counts.end(), 0);
    for (int v = block_v * factor; v < block_v * factor + rows; ++v) {
      const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(v) * image.width;
      countExtremes(image.pixels.data() + first, allowed + first, image.width, value, counts.data());
    }
    if (std::accumulate(counts.begin(), counts.end(), 0U, std::bit_or<>()) == 0U) continue;
    std::fill(sums.begin(), sums.end(), 0);
    for (int column = 0; column < cols; ++column) {
      const std::uint16_t* count = counts.data() + column;
      for (int& sum : sums) {
        sum += *count;
        count += factor;
      }
    }
    std::uint8_t* target = blocks.ptr<std::uint8_t>(block_v);
    for (std::size_t i = 0; i < sums.size(); ++i) target[i] = 4 * sums[i] >= rows * cols ? kUse : 0;
  }
  return blocks;
}

/// Where an image has its extreme values, in counts or floats, whichever it came in.
class Extremes {
 public:
  Extremes(const AttenuationImage& image, const std::uint8_t* allowed) : image_(image), allowed_(allowed) {
    if (image.counts() != nullptr) {
      counts_ = spanOf(*image.counts(), allowed);
      if (counts_.low > counts_.high) return;
      const auto [low, high] = std::minmax(image.worth()[counts_.low], image.worth()[counts_.high]);
      values_ = {low, high};
    } else {
      values_ = spanOf(*image.plain(), allowed);
    }
  }

  /// Not above zero where no pixel is allowed.
  float range() const { return values_.high - values_.low; }
  float low() const { return values_.low; }
  float high() const { return values_.high; }

  cv::Mat blocks(const Span<float>& value, int factor, const cv::Size& size) const {
    if (image_.counts() == nullptr) return blocksOf(*image_.plain(), allowed_, value, factor, size);
    return blocksOf(*image_.counts(), allowed_, countsWorth(image_.worth(), counts_, value), factor, size);
  }

 private:
  const AttenuationImage& image_;
  const std::uint8_t* allowed_;
  Span<std::uint16_t> counts_{1, 0};
  Span<float> values_{0.0F, 0.0F};
};

}  // namespace

cv::Mat mask_detail::lettersIn(const SearchCopy& copy, const MaskImage& field) {
  const AttenuationImage& image = copy.image();
  if (image.empty()) return {};
  const MaskImage everywhere = field.empty() ? MaskImage(image.width(), image.height(), kUse) : MaskImage();
  const Extremes extremes(image, (field.empty() ? everywhere : field).pixels.data());
  const float range = extremes.range();
  if (!(range > 0.0F)) return {};

  const cv::Mat& small = copy.fine();
  cv::Mat steps;
  cv::morphologyEx(small, steps, cv::MORPH_GRADIENT, cv::Mat::ones(9, 9, CV_8U), {-1, -1}, 1, cv::BORDER_REPLICATE);
  cv::Mat letters = cv::Mat::zeros(small.size(), CV_8U);
  const float margin = kExtremeShare * range;
  for (const float value : {extremes.low(), extremes.high()}) {
    const cv::Mat blocks = extremes.blocks({value - margin, value + margin}, copy.factor(), small.size());
    findLetters(small, steps, blocks, value, kSmallestStep * range, &letters);
  }
  cv::dilate(letters, letters, cv::Mat::ones(2 * kRim + 1, 2 * kRim + 1, CV_8U));
  return letters;
}

MaskImage letterMask(const AttenuationImage& raw, const MaskImage& field) {
  MaskImage result(raw.width(), raw.height(), kUse);
  const mask_detail::SearchCopy copy(raw);
  mask_detail::leaveOut(mask_detail::lettersIn(copy, field), copy.factor(), &result);
  return result;
}

}  // namespace xray_registration
