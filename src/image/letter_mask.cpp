#include <algorithm>
#include <cmath>
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

/// Largest of `values` over the pixels of each label.
std::vector<float> largestPerLabel(const cv::Mat& values, const cv::Mat& labels, int count) {
  std::vector<float> largest(static_cast<std::size_t>(count), 0.0F);
  for (int v = 0; v < labels.rows; ++v) {
    const int* label = labels.ptr<int>(v);
    const float* value = values.ptr<float>(v);
    for (int u = 0; u < labels.cols; ++u) {
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

/// The pixels that have an extreme value.
struct ExtremeValue {
  float low;
  float high;
};

/// Adds one for each pixel of a row that has the value and is allowed. Without branches, for vector instructions.
void countExtremes(const cv::Mat& image, const cv::Mat& allowed, int v, const ExtremeValue& value,
                   std::vector<std::uint16_t>* counts) {
  const float* pixels = image.ptr<float>(v);
  const std::uint8_t* use = allowed.ptr<std::uint8_t>(v);
  std::uint16_t* count = counts->data();
  const float low = value.low;
  const float high = value.high;
  const int cols = image.cols;
  for (int u = 0; u < cols; ++u) {
    count[u] = static_cast<std::uint16_t>(count[u] + ((pixels[u] >= low) & (pixels[u] <= high) & (use[u] != 0)));
  }
}

/// Blocks of factor × factor pixels at least a quarter of which have the value and are allowed.
cv::Mat blocksOf(const cv::Mat& image, const cv::Mat& allowed, const ExtremeValue& value, int factor,
                 const cv::Size& size) {
  cv::Mat blocks(size, CV_8U);
  if (factor == 1) {
    cv::inRange(image, value.low, value.high, blocks);
    return blocks & allowed;
  }
  const int rows = std::min(factor, image.rows);
  const int cols = std::min(factor, image.cols);
  std::vector<std::uint16_t> counts(static_cast<std::size_t>(image.cols));
  std::vector<int> sums(static_cast<std::size_t>(size.width));
  for (int block_v = 0; block_v < size.height; ++block_v) {
    std::fill(counts.begin(), counts.end(), 0);
    for (int v = block_v * factor; v < block_v * factor + rows; ++v) {
      countExtremes(image, allowed, v, value, &counts);
    }
    std::uint8_t* target = blocks.ptr<std::uint8_t>(block_v);
    std::fill_n(target, size.width, 0);
    if (cv::countNonZero(cv::Mat(counts)) == 0) continue;
    std::fill(sums.begin(), sums.end(), 0);
    for (int column = 0; column < cols; ++column) {
      const std::uint16_t* count = counts.data() + column;
      for (int& sum : sums) {
        sum += *count;
        count += factor;
      }
    }
    for (std::size_t i = 0; i < sums.size(); ++i) target[i] = 4 * sums[i] >= rows * cols ? kUse : 0;
  }
  return blocks;
}

}  // namespace

cv::Mat mask_detail::lettersIn(const SearchCopy& copy, const MaskImage& field) {
  if (copy.image().empty()) return {};
  const cv::Mat image = copy.whole();
  const MaskImage everywhere = field.empty() ? MaskImage(image.cols, image.rows, kUse) : MaskImage();
  const cv::Mat allowed = mask_detail::view(field.empty() ? everywhere : field);
  double low = 0.0;
  double high = 0.0;
  cv::minMaxLoc(image, &low, &high, nullptr, nullptr, allowed);
  const auto range = static_cast<float>(high - low);
  if (!(range > 0.0F)) return {};

  const cv::Mat& small = copy.fine();
  cv::Mat steps;
  cv::morphologyEx(small, steps, cv::MORPH_GRADIENT, cv::Mat::ones(9, 9, CV_8U), {-1, -1}, 1, cv::BORDER_REPLICATE);
  cv::Mat letters = cv::Mat::zeros(small.size(), CV_8U);
  const double margin = kExtremeShare * range;
  for (const double value : {low, high}) {
    const ExtremeValue extreme{static_cast<float>(value - margin), static_cast<float>(value + margin)};
    const cv::Mat blocks = blocksOf(image, allowed, extreme, copy.factor(), small.size());
    findLetters(small, steps, blocks, static_cast<float>(value), kSmallestStep * range, &letters);
  }
  cv::dilate(letters, letters, cv::Mat::ones(2 * kRim + 1, 2 * kRim + 1, CV_8U));
  return letters;
}

MaskImage letterMask(const FloatImage& raw, const MaskImage& field) {
  MaskImage result(raw.width, raw.height, kUse);
  const mask_detail::SearchCopy copy(raw);
  mask_detail::leaveOut(mask_detail::lettersIn(copy, field), copy.factor(), &result);
  return result;
}

}  // namespace xray_registration
