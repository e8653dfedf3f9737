#pragma once

#include <opencv2/core.hpp>

#include "xray_registration/image/image.h"

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

/// Each pixel factor × factor times; what is missing at the right and bottom repeats the last column and row.
cv::Mat grown(const cv::Mat& mask, int factor, const cv::Size& size);

/// Values at two shares (0…1) of the sorted pixels; at most about 10⁴ pixels are looked at.
struct Range {
  float low;
  float high;
};
Range percentiles(const cv::Mat& image, double low, double high);

}  // namespace mask_detail
}  // namespace xray_registration
