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

constexpr int kLongestSide = 640;
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
void findLetters(const cv::Mat& image, const cv::Mat& steps, const cv::Mat& extreme, float value, float least_step,
                 cv::Mat* letters) {
  if (cv::countNonZero(extreme & (steps > least_step)) < kSmallestArea) return;
  cv::Mat labels;
  cv::Mat statistics;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(extreme, labels, statistics, centroids, 8, CV_32S);
  const std::vector<float> step = largestPerLabel(steps, labels, count);
  const int longest_side = std::max(image.cols, image.rows);
  const double stroke = std::max(2.0, kThickestStroke * longest_side);
  for (int i = 1; i < count; ++i) {
    const int* row = statistics.ptr<int>(i);
    const cv::Rect box(row[cv::CC_STAT_LEFT], row[cv::CC_STAT_TOP], row[cv::CC_STAT_WIDTH], row[cv::CC_STAT_HEIGHT]);
    const int area = row[cv::CC_STAT_AREA];
    if (step[static_cast<std::size_t>(i)] < least_step || area < kSmallestArea) continue;
    if (std::max(box.width, box.height) > kLargestLetter * longest_side) continue;
    if (area > stroke * 2.0 * (box.width + box.height)) continue;
    if (groundIsFlat(image, extreme, labels, i, box, value, least_step)) (*letters)(box).setTo(kUse, labels(box) == i);
  }
}

/// Blocks that hold at least a quarter of pixels of the extreme value.
cv::Mat blocksOf(const cv::Mat& extreme, int factor) { return mask_detail::shrunk(extreme, factor) > kUse / 4; }

}  // namespace

MaskImage letterMask(const FloatImage& raw, const MaskImage& field) {
  MaskImage result(raw.width, raw.height, kUse);
  if (raw.empty()) return result;
  const cv::Mat image = mask_detail::view(raw);
  double low = 0.0;
  double high = 0.0;
  cv::minMaxLoc(image, &low, &high, nullptr, nullptr, field.empty() ? cv::noArray() : mask_detail::view(field));
  const auto range = static_cast<float>(high - low);
  if (!(range > 0.0F)) return result;

  const int factor = mask_detail::factorFor(image.size(), kLongestSide);
  const cv::Mat small = mask_detail::shrunk(image, factor);
  cv::Mat steps;
  cv::morphologyEx(small, steps, cv::MORPH_GRADIENT, cv::Mat::ones(9, 9, CV_8U), {-1, -1}, 1, cv::BORDER_REPLICATE);
  cv::Mat letters = cv::Mat::zeros(small.size(), CV_8U);
  for (const double value : {low, high}) {
    cv::Mat extreme;
    cv::inRange(image, value - kExtremeShare * range, value + kExtremeShare * range, extreme);
    if (!field.empty()) extreme &= mask_detail::view(field);
    findLetters(small, steps, blocksOf(extreme, factor), static_cast<float>(value), kSmallestStep * range, &letters);
  }
  cv::dilate(letters, letters, cv::Mat::ones(2 * kRim + 1, 2 * kRim + 1, CV_8U));
  mask_detail::view(result).setTo(0, mask_detail::grown(letters, factor, image.size()));
  return result;
}

}  // namespace xray_registration
