#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "xray_registration/image/attenuation_image.h"

// What the three searches for things to mask share. Private to this room.
namespace xray_registration {
namespace mask_detail {

constexpr std::uint8_t kUse = 255;

/// The image's own memory as a cv::Mat; not to be written to.
cv::Mat view(const FloatImage& image);
cv::Mat view(const MaskImage& mask);

/// Smallest factor that leaves no side longer than `longest_side`.
int factorFor(const cv::Size& size, int longest_side);

/// Mean over factor × factor blocks; partial blocks are dropped.
cv::Mat shrunk(const cv::Mat& image, int factor);
/// The same in one pass over an image's pixels as they came.
cv::Mat shrunk(const AttenuationImage& image, int factor);

/// 255 for the blocks of factor × factor pixels that are 255 throughout; partial blocks are dropped.
cv::Mat wholeBlocks(const cv::Mat& mask, int factor);

/// Some rows of a mask that has each pixel factor × factor times; what is missing up to `width`, and at the bottom,
/// repeats the last column and row.
cv::Mat grown(const cv::Mat& mask, int factor, int width, const cv::Range& rows);

/// The smallest rectangle around all that is not zero, with a rim of `rim` pixels, inside the image. Empty when all is
/// zero.
cv::Rect boxAround(const cv::Mat& mask, int rim);

/// A connected part of a region.
struct Part {
  cv::Rect box;
  int pixels = 0;
};

/// The connected parts of what is not zero: of each pixel the number of its part, 0 where the region is zero, and what
/// belongs to a number. Without centroids and OpenCV's sums for them, which take most of the time.
struct Parts {
  cv::Mat labels;           ///< CV_32S
  std::vector<Part> parts;  ///< By label; the first means nothing.
};
Parts partsOf(const cv::Mat& region, int connectivity);

/// Zeroes the pixels of `mask` where `found`, grown by `factor`, is not zero.
void leaveOut(const cv::Mat& found, int factor, MaskImage* mask);

/// Values at two shares (0…1) of the sorted pixels; at most about 10⁴ pixels are looked at.
struct Range {
  float low;
  float high;
};
Range percentiles(const cv::Mat& image, double low, double high);
float percentile(const cv::Mat& image, double share);

/// An image and its copy with no side longer than kFineSide, for two searches.
class SearchCopy {
 public:
  static constexpr int kFineSide = 640;

  /// The image must stay.
  explicit SearchCopy(const AttenuationImage& image)
      : image_(image), factor_(factorFor({image.width(), image.height()}, kFineSide)), fine_(shrunk(image, factor_)) {}

  const AttenuationImage& image() const { return image_; }
  int factor() const { return factor_; }
  const cv::Mat& fine() const { return fine_; }

 private:
  const AttenuationImage& image_;
  int factor_;
  cv::Mat fine_;
};

/// The field inside of what a device has drawn around it, in whatever value, on the copy `small` of `image`: not zero.
/// Empty when nothing was drawn.
cv::Mat drawnField(const AttenuationImage& image, const cv::Mat& small, int factor);

/// fieldMask of what was copied.
MaskImage fieldIn(const SearchCopy& copy);

/// The searches of mask.h: what is found on the copy, not zero; of the copy's size, or empty when there is nothing.
/// `known`: of the copy's size, not zero where metal was before; may be empty.
cv::Mat lettersIn(const SearchCopy& copy, const MaskImage& field);
cv::Mat metalIn(const SearchCopy& copy, const MaskImage& field, const cv::Mat& known = {});

}  // namespace mask_detail
}  // namespace xray_registration
