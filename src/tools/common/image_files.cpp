#include "tools/common/image_files.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <vector>

#include "xray_registration/common/statistics.h"

namespace xray_registration::tools {
namespace {

cv::Mat matOf(const FloatImage& image) {
  cv::Mat mat(image.height, image.width, CV_32F);
  std::copy(image.pixels.begin(), image.pixels.end(), mat.ptr<float>());
  return mat;
}

cv::Mat eightBits(const FloatImage& image, double low, double high) {
  const double scale = high == low ? 0.0 : 255.0 / (high - low);
  cv::Mat grey;
  matOf(image).convertTo(grey, CV_8U, scale, -low * scale);
  return grey;
}

/// Grey values between which all but the darkest and brightest hundredth lie, so that single pixels decide nothing.
std::pair<double, double> displayRange(const FloatImage& image) {
  std::vector<float> values = image.pixels;
  if (values.empty()) throw std::runtime_error("an image without pixels cannot be written");
  return {quantileBelow(&values, 0.005), quantileBelow(&values, 0.995)};
}

}  // namespace

void writePng(const std::string& path, const cv::Mat& image) {
  bool written = false;
  try {
    written = cv::imwrite(path, image);
  } catch (const cv::Exception& error) {
    throw std::runtime_error(path + ": cannot be written: " + error.what());
  }
  if (!written) throw std::runtime_error(path + ": cannot be written");
}

void writeGreyPng(const std::string& path, const FloatImage& image, double low, double high) {
  writePng(path, eightBits(image, low, high));
}

void writeGreyPng(const std::string& path, const FloatImage& image) {
  const auto [low, high] = displayRange(image);
  writePng(path, eightBits(image, low, high));
}

void writeMha(const std::string& path, const FloatImage& image) {
  std::ofstream stream(path, std::ios::binary);
  stream << "ObjectType = Image\nNDims = 2\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
         << "DimSize = " << image.width << ' ' << image.height << "\nElementSpacing = 1 1\n"
         << "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n";
  stream.write(reinterpret_cast<const char*>(image.pixels.data()),
               static_cast<std::streamsize>(image.pixels.size() * sizeof(float)));
  if (!stream.flush()) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace xray_registration::tools
