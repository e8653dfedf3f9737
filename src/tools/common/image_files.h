#pragma once

#include <string>

#include "xray_registration/image/image.h"

namespace cv {
class Mat;
}

namespace xray_registration::tools {

/// An image as OpenCV has it: grey or BGR, 8 bits.
/// @throws std::runtime_error naming the file when it cannot be written.
void writePng(const std::string& path, const cv::Mat& image);

/// An 8-bit PNG; `low` becomes black and `high` white, and the other way round when low > high.
/// @throws std::runtime_error naming the file when it cannot be written.
void writeGreyPng(const std::string& path, const FloatImage& image, double low, double high);

/// The same from the image's smallest to its largest value, or the reverse for a picture as on film (bones bright).
void writeGreyPng(const std::string& path, const FloatImage& image);

/// Float values as MetaImage (.mha), pixel spacing 1.
void writeMha(const std::string& path, const FloatImage& image);

}  // namespace xray_registration::tools
