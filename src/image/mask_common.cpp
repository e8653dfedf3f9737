#include "image/mask_common.h"

#include <algorithm>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "xray_registration/common/statistics.h"

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

cv::Mat shrunk(const AttenuationImage& image, int factor) {
  cv::Mat result(std::max(1, image.height() / factor), std::max(1, image.width() / factor), CV_32F);
  const int rows = std::min(factor, image.height());
  const int cols = std::min(factor, image.width());
  const float share = 1.0F / static_cast<float>(rows * cols);
  cv::parallel_for_({0, result.rows}, [&](const cv::Range& blocks) {
    std::vector<float> buffer;
    std::vector<float> sums(static_cast<std::size_t>(result.cols * cols));
    for (int v = blocks.start; v < blocks.end; ++v) {
      std::fill(sums.begin(), sums.end(), 0.0F);
      for (int i = 0; i < rows; ++i) {
        const float* row = image.row(v * factor + i, 0, static_cast<int>(sums.size()), &buffer);
        for (std::size_t u = 0; u < sums.size(); ++u) sums[u] += row[u];
      }
      const float* sum = sums.data();
      float* target = result.ptr<float>(v);
      for (int u = 0; u < result.cols; ++u, sum += cols) target[u] = share * std::accumulate(sum, sum + cols, 0.0F);
    }
  });
  return result;
}

cv::Mat wholeBlocks(const cv::Mat& mask, int factor) {
  if (factor == 1) return mask == kUse;
  cv::Mat result(std::max(1, mask.rows / factor), std::max(1, mask.cols / factor), CV_8U);
  const int rows = std::min(factor, mask.rows);
  const int cols = std::min(factor, mask.cols);
  std::vector<std::uint8_t> common(static_cast<std::size_t>(mask.cols));
  for (int v = 0; v < result.rows; ++v) {
    std::fill(common.begin(), common.end(), kUse);
    for (int i = 0; i < rows; ++i) {
      const std::uint8_t* row = mask.ptr<std::uint8_t>(v * factor + i);
      for (std::size_t u = 0; u < common.size(); ++u) common[u] &= row[u];
    }
    std::uint8_t* target = result.ptr<std::uint8_t>(v);
    for (int u = 0; u < result.cols; ++u) {
      const auto first = common.begin() + u * factor;
      target[u] = std::all_of(first, first + cols, [](std::uint8_t value) { return value == kUse; }) ? kUse : 0;
    }
  }
  return result;
}

cv::Mat grown(const cv::Mat& mask, int factor, int width, const cv::Range& rows) {
  cv::Mat result(rows.size(), width, CV_8U);
  for (int v = rows.start; v < rows.end; ++v) {
    const std::uint8_t* blocks = mask.ptr<std::uint8_t>(std::min(v / factor, mask.rows - 1));
    std::uint8_t* row = result.ptr<std::uint8_t>(v - rows.start);
    for (int block = 0; block < mask.cols; ++block) {
      const int end = block + 1 == mask.cols ? width : (block + 1) * factor;
      std::fill(row + block * factor, row + end, blocks[block]);
    }
  }
  return result;
}

cv::Rect boxAround(const cv::Mat& mask, int rim) {
  const cv::Rect box = cv::boundingRect(mask);
  if (box.empty()) return {};
  return (box + cv::Size(2 * rim, 2 * rim) - cv::Point(rim, rim)) & cv::Rect({0, 0}, mask.size());
}

void leaveOut(const cv::Mat& found, int factor, MaskImage* mask) {
  for (int block_v = 0; block_v < found.rows; ++block_v) {
    if (cv::countNonZero(found.row(block_v)) == 0) continue;
    const std::uint8_t* row = found.ptr<std::uint8_t>(block_v);
    const int end_v = block_v + 1 == found.rows ? mask->height : (block_v + 1) * factor;
    for (int block_u = 0; block_u < found.cols; ++block_u) {
      if (row[block_u] == 0) continue;
      const int end_u = block_u + 1 == found.cols ? mask->width : (block_u + 1) * factor;
      for (int v = block_v * factor; v < end_v; ++v)
        std::fill(&mask->at(block_u * factor, v), &mask->at(0, v) + end_u, 0);
    }
  }
}

namespace {

std::vector<float> sampled(const cv::Mat& image) {
  const int stride = std::max(1, static_cast<int>(std::min(image.rows, image.cols) / 100));
  std::vector<float> values;
  for (int v = stride / 2; v < image.rows; v += stride) {
    const float* row = image.ptr<float>(v);
    for (int u = stride / 2; u < image.cols; u += stride) values.push_back(row[u]);
  }
  return values;
}

}  // namespace

float percentile(const cv::Mat& image, double share) {
  std::vector<float> values = sampled(image);
  return quantileBelow(&values, share);
}

Range percentiles(const cv::Mat& image, double low, double high) {
  std::vector<float> values = sampled(image);
  return {quantileBelow(&values, low), quantileBelow(&values, high)};
}

Parts partsOf(const cv::Mat& region, int connectivity) {
  Parts found;
  const int count = cv::connectedComponents(region, found.labels, connectivity, CV_32S);
  found.parts.resize(static_cast<std::size_t>(count));
  for (int v = 0; v < region.rows; ++v) {
    const int* label = found.labels.ptr<int>(v);
    for (int u = 0; u < region.cols;) {
      const int own = label[u];
      int end = u + 1;
      while (end < region.cols && label[end] == own) ++end;
      if (own != 0) {
        Part& part = found.parts[static_cast<std::size_t>(own)];
        const cv::Rect run(u, v, end - u, 1);
        part.box = part.pixels == 0 ? run : part.box | run;
        part.pixels += run.width;
      }
      u = end;
    }
  }
  return found;
}

}  // namespace mask_detail
}  // namespace xray_registration
