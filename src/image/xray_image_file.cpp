#include "xray_registration/image/xray_image_file.h"

#include <filesystem>
#include <fstream>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "image/itk_xray_file.h"

namespace xray_registration {
namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw XrayFileError("'" + path + "': " + what);
}

void checkIsFile(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) refuse(path, "there is no such file");
  if (!std::ifstream(path)) refuse(path, "the file cannot be opened; are you allowed to read it?");
}

double saturationOf(const cv::Mat& picture) {
  if (picture.depth() == CV_8U) return std::numeric_limits<std::uint8_t>::max();
  if (picture.depth() == CV_16U) return std::numeric_limits<std::uint16_t>::max();
  return static_cast<double>(std::numeric_limits<float>::max());
}

template <typename Pixel>
Image<Pixel> pixelsOf(const cv::Mat& picture) {
  Image<Pixel> image(picture.cols, picture.rows);
  constexpr int kType = cv::DataType<Pixel>::type;
  picture.convertTo(cv::Mat(picture.rows, picture.cols, kType, image.pixels.data()), kType);
  return image;
}

}  // namespace

RawImage readXrayImage(const std::string& path) {
  checkIsFile(path);
  if (auto dicom = readXrayDicom(path)) return std::move(*dicom);
  cv::Mat picture;
  try {
    picture = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  } catch (const cv::Exception&) {
    picture.release();  // Damaged, which is said below.
  }
  if (picture.empty()) refuse(path, "it is no DICOM, PNG, TIFF or PGM image, or it is damaged");
  RawImage raw;
  const bool counts = picture.depth() == CV_8U || picture.depth() == CV_16U;
  raw.pixels = counts ? RawPixels(pixelsOf<std::uint16_t>(picture)) : RawPixels(pixelsOf<float>(picture));
  raw.saturation = saturationOf(picture);
  return raw;
}

}  // namespace xray_registration
