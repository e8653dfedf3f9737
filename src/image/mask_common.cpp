#include "image/mask_common.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace xray_registration {
namespace mask_detail {

cv::Mat view(const FloatImage& image) {
  return cv::Mat(image.height, image.width, CV_32F, const_cast<float*>(image.pixels.data()));
}

cv::Mat view(const MaskImage& mask) {
  return cv::Mat(mask.height, mask.width, CV_8U, const_cast<std::uint8_t*>(mask.pixels.data()));
}

int factorFor(const cv::Size& size, int longest_side) {
  return std::max(1, (std::max(size.width, size.height) + longest_side - 1) / longest_side);
}

cv::Mat shrunk(const cv::Mat& image, int factor) {
  if (factor == 1) return image;
  const cv::Size size(std::max(1, image.cols / factor), std::max(1, image.rows / factor));
  const cv::Rect whole_blocks(0, 0, std::min(image.cols, size.width * factor),
                              std::min(image.rows, size.height * factor));
  cv::Mat result;
  cv::resize(image(whole_blocks), result, size, 0.0, 0.0, cv::INTER_AREA);
  return result;
}

cv::Mat grown(const cv::Mat& mask, int factor, const cv::Size& size) {
  if (factor == 1) return mask;
  cv::Mat result;
  cv::resize(mask, result, {mask.cols * factor, mask.rows * factor}, 0.0, 0.0, cv::INTER_NEAREST);
  const int right = std::max(0, size.width - result.cols);
  const int bottom = std::max(0, size.height - result.rows);
  if (right > 0 || bottom > 0) cv::copyMakeBorder(result, result, 0, bottom, 0, right, cv::BORDER_REPLICATE);
  return result(cv::Rect({0, 0}, size));
}

Range percentiles(const cv::Mat& image, double low, double high) {
  const int stride = std::max(1, static_cast<int>(std::min(image.rows, image.cols) / 100));
  std::vector<float> values;
  for (int v = stride / 2; v < image.rows; v += stride) {
    const float* row = image.ptr<float>(v);
    for (int u = stride / 2; u < image.cols; u += stride) values.push_back(row[u]);
  }
  const auto at = [&values](double share) {
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[static_cast<std::size_t>(rank)];
  };
  return {at(low), at(high)};
}

}  // namespace mask_detail
}  // namespace xray_registration
