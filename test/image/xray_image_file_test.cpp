#include "xray_registration/image/xray_image_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "test/volume/test_files.h"

namespace xray_registration {
namespace {

using test_files::TemporaryFolder;

template <typename T>
cv::Mat ramp(int type) {
  cv::Mat picture(12, 20, type);
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u) picture.at<T>(v, u) = static_cast<T>(10 * v + u);
  }
  return picture;
}

void expectRamp(const RawImage& raw) {
  ASSERT_EQ(raw.pixels.width(), 20);
  ASSERT_EQ(raw.pixels.height(), 12);
  for (int v = 0; v < 12; ++v) {
    for (int u = 0; u < 20; ++u) ASSERT_EQ(floatsOf(raw.pixels).at(u, v), static_cast<float>(10 * v + u));
  }
}

std::string errorOf(const std::string& path) {
  try {
    readXrayImage(path);
  } catch (const XrayFileError& error) {
    return error.what();
  }
  return "no error";
}

TEST(XrayImageFile, PicturesKeepTheirValuesAndBits) {
  const TemporaryFolder folder;
  cv::imwrite(folder / "a.pgm", ramp<std::uint8_t>(CV_8U));
  cv::imwrite(folder / "b.png", ramp<std::uint16_t>(CV_16U));
  cv::imwrite(folder / "c.tif", ramp<float>(CV_32F));
  expectRamp(readXrayImage(folder / "a.pgm"));
  expectRamp(readXrayImage(folder / "b.png"));
  expectRamp(readXrayImage(folder / "c.tif"));
  EXPECT_EQ(readXrayImage(folder / "a.pgm").saturation, 255.0);
  EXPECT_EQ(readXrayImage(folder / "b.png").saturation, 65535.0);
  EXPECT_EQ(readXrayImage(folder / "c.tif").saturation, static_cast<double>(std::numeric_limits<float>::max()));
}

test_files::DicomFile dicom() {
  test_files::DicomFile file;
  file.modality = "XA";
  file.columns = 20;
  file.rows = 12;
  file.slope = 0.5;
  file.intercept = -100.0;
  for (int i = 0; i < 240; ++i) file.pixels.push_back(static_cast<std::uint16_t>(2 * (10 * (i / 20) + i % 20 + 100)));
  return file;
}

TEST(XrayImageFile, DicomIsReadWithItsRescale) {
  const TemporaryFolder folder;
  // The ending does not tell.
  test_files::writeDicom(folder / "IM1", dicom());
  expectRamp(readXrayImage(folder / "IM1"));
}

TEST(XrayImageFile, WhatIsNoPictureIsRefusedByName) {
  const TemporaryFolder folder;
  test_files::writeBytes(folder / "words.png", "words");
  test_files::writeBytes(folder / "empty.dcm", "");
  for (const char* name : {"words.png", "empty.dcm"}) {
    const std::string error = errorOf(folder / name);
    EXPECT_NE(error.find(name), std::string::npos) << error;
    EXPECT_NE(error.find("no DICOM, PNG, TIFF or PGM"), std::string::npos) << error;
  }
  EXPECT_NE(errorOf(folder / "none.png").find("no such file"), std::string::npos);
  EXPECT_NE(errorOf(folder.path().string()).find("no such file"), std::string::npos);

  test_files::writeDicom(folder / "cut.dcm", dicom());
  std::filesystem::resize_file(folder / "cut.dcm", std::filesystem::file_size(folder / "cut.dcm") - 100);
  EXPECT_NE(errorOf(folder / "cut.dcm").find("cut.dcm"), std::string::npos) << errorOf(folder / "cut.dcm");
  test_files::DicomFile colour = dicom();
  colour.samples_per_pixel = 3;
  colour.pixels.resize(720, 7);
  test_files::writeDicom(folder / "colour.dcm", colour);
  EXPECT_NE(errorOf(folder / "colour.dcm").find("colour"), std::string::npos) << errorOf(folder / "colour.dcm");
}

TEST(XrayImageFile, RealXrays) {
  const char* data = std::getenv("XRAY_REGISTRATION_DATA");
  if (data == nullptr) GTEST_SKIP() << "XRAY_REGISTRATION_DATA does not name the recorded X-rays";
  const std::string folder = std::string(data) + "/xray_dicom/";
  const RawImage raw = readXrayImage(folder + "siemens_arcadis_grid_centred.dcm");
  EXPECT_EQ(raw.pixels.width(), 1024);
  EXPECT_EQ(raw.pixels.height(), 1024);
  EXPECT_EQ(raw.saturation, 4095.0);
  EXPECT_NE(errorOf(folder + "ge_xa_IM1.dcm").find("14 frames"), std::string::npos);
  // Compressed files are unpacked.
  EXPECT_EQ(readXrayImage(folder + "nema_xa1_jpeg2000.dcm").pixels.width(), 1024);
}

}  // namespace
}  // namespace xray_registration
