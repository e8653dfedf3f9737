#include "xray_registration/image/xray_dicom.h"

#include <gdcmAttribute.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>
#include <gdcmSequenceOfItems.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "image/dicom/gdcm_file.h"
#include "xray_registration/image/xray_dicom_geometry.h"
#include "xray_registration/image/xray_dicom_writer.h"

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

/// A folder that goes with the test.
class XrayDicomTest : public testing::Test {
 protected:
  XrayDicomTest() : folder_(fs::path(testing::TempDir()) / ("xray_dicom_test_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~XrayDicomTest() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

 private:
  fs::path folder_;
};

/// Every pixel of every frame has a value of its own, up to 12 bits.
XrayAngiogram run(std::size_t frames = 3) {
  XrayAngiogram run;
  for (std::size_t i = 0; i < frames; ++i) {
    Image<std::uint16_t> image(20, 16);
    for (std::size_t k = 0; k < image.pixels.size(); ++k)
      image.pixels[k] = static_cast<std::uint16_t>(1000 * i + 3 * k);
    run.frames.push_back(image);
  }
  run.bits = 12;
  run.frame_time_s = 0.25;
  run.pixel_mm = 0.3;
  run.source_detector_mm = 1100;
  run.source_isocentre_mm = 750;
  run.primary_deg = -31.25;
  run.secondary_deg = 12.5;
  return run;
}

void expectPixels(const XrayDicomFile& file, const XrayAngiogram& run) {
  ASSERT_EQ(file.header().frames.size(), run.frames.size());
  for (std::size_t i = 0; i < run.frames.size(); ++i) {
    const FloatImage frame = file.frame(i, false);
    ASSERT_EQ(frame.width, run.frames[i].width);
    ASSERT_TRUE(std::equal(frame.pixels.begin(), frame.pixels.end(), run.frames[i].pixels.begin())) << "frame " << i;
  }
}

std::string saidOf(const std::string& path) {
  try {
    XrayDicomFile file(path);
  } catch (const XrayDicomError& error) {
    return error.what();
  }
  return "nothing";
}

/// A file with other attributes, whatever the reader's kind.
template <typename Change>
void rewrite(const std::string& from, const std::string& to, const Change& change) {
  gdcm::ImageReader reader;
  reader.SetFileName(from.c_str());
  ASSERT_TRUE(reader.Read());
  gdcm::ImageWriter writer;
  writer.SetImage(reader.GetImage());
  writer.SetFile(reader.GetFile());
  change(&writer.GetFile().GetDataSet(), &writer.GetImage());
  writer.SetFileName(to.c_str());
  ASSERT_TRUE(writer.Write());
}

template <std::uint16_t Group, std::uint16_t Number, typename T>
void set(gdcm::DataSet* data, const T& value) {
  gdcm::Attribute<Group, Number> attribute;
  attribute.SetValue(value);
  data->Replace(attribute.GetAsDataElement());
}

TEST_F(XrayDicomTest, WhatIsWrittenIsRead) {
  writeXrayAngiogram(path("run.dcm"), run());
  const XrayDicomFile file(path("run.dcm"));
  expectPixels(file, run());
  const DicomHeader& header = file.header();
  EXPECT_EQ(header.modality, "XA");
  EXPECT_EQ(header.bits, 12);
  EXPECT_EQ(header.relationship, "LIN");
  EXPECT_DOUBLE_EQ(header.frames[2].time_s, 0.5);
  const DicomGeometry geometry = dicomGeometry(header, header.frames[0]);
  EXPECT_EQ(geometry.source_detector_mm.value, 1100);
  EXPECT_EQ(geometry.source_isocentre_mm.value, 750);
  EXPECT_EQ(geometry.pixel_mm.value, (RowColumn{0.3, 0.3}));
  EXPECT_EQ(geometry.primary_deg.value, -31.25);
  EXPECT_EQ(geometry.secondary_deg.value, 12.5);
  EXPECT_TRUE(file.isIntegral());
  EXPECT_EQ(file.fullScale(), 4095);
  EXPECT_THROW(file.frame(3, false), std::out_of_range);
}

TEST_F(XrayDicomTest, WhoThePatientIsStaysInTheFile) {
  writeXrayAngiogram(path("run.dcm"), run(1));
  for (const auto& [tag, element] : dicom::readFile(path("run.dcm")).attributes.elements) {
    EXPECT_NE(tag >> 16U, 0x0010U) << dicom::inWords(tag);
    for (const std::string& word : element.words) EXPECT_EQ(word.find("SIMULATED"), std::string::npos);
  }
}

TEST_F(XrayDicomTest, ReversedIsFullScaleMinusTheValue) {
  writeXrayAngiogram(path("run.dcm"), run(1));
  const XrayDicomFile file(path("run.dcm"));
  EXPECT_EQ(file.frame(0, true).at(1, 0), 4095 - 3);
}

TEST_F(XrayDicomTest, EveryLosslessCompressionIsRead) {
  writeXrayAngiogram(path("run.dcm"), run());
  for (const auto syntax : {gdcm::TransferSyntax::ImplicitVRLittleEndian, gdcm::TransferSyntax::JPEGLosslessProcess14_1,
                            gdcm::TransferSyntax::JPEGLSLossless, gdcm::TransferSyntax::JPEG2000Lossless,
                            gdcm::TransferSyntax::RLELossless}) {
    rewrite(path("run.dcm"), path("packed.dcm"), [syntax](gdcm::DataSet*, gdcm::Image* image) {
      gdcm::ImageChangeTransferSyntax change;
      change.SetTransferSyntax(syntax);
      change.SetInput(*image);
      ASSERT_TRUE(change.Change());
      *image = change.GetOutput();
    });
    SCOPED_TRACE(gdcm::TransferSyntax::GetTSString(syntax));
    expectPixels(XrayDicomFile(path("packed.dcm")), run());
  }
}

TEST_F(XrayDicomTest, OtherThingsInUnusedBitsAreLeftOut) {
  XrayAngiogram dirty = run(1);
  for (auto& pixel : dirty.frames.front().pixels) pixel = static_cast<std::uint16_t>(pixel | 0x8000U);
  writeXrayAngiogram(path("dirty.dcm"), dirty);
  expectPixels(XrayDicomFile(path("dirty.dcm")), run(1));
}

TEST(StoredBitsTest, AValueIsCutOutOfItsPixel) {
  const auto value = [](const dicom::StoredBits& bits, std::uint16_t pixel) {
    std::array<char, 2> bytes{};
    std::memcpy(bytes.data(), &pixel, sizeof pixel);
    return bits.value(bytes.data());
  };
  EXPECT_EQ(value({2, 12, 0, false}, 0xF123), 0x123);
  EXPECT_EQ(value({2, 12, 4, false}, 0x123F), 0x123);
  EXPECT_EQ(value({2, 12, 0, true}, 0x0FFF), -1);
  EXPECT_EQ(value({2, 12, 0, true}, 0x07FF), 0x7FF);
  EXPECT_EQ(value({1, 8, 0, false}, 0xFF07), 7);
}

TEST_F(XrayDicomTest, SignedValuesAreCountedFromZero) {
  XrayAngiogram negative = run(1);
  negative.frames.front().pixels[2] = 4095;  // As 12 bits with a sign: −1.
  writeXrayAngiogram(path("run.dcm"), negative);
  rewrite(path("run.dcm"), path("signed.dcm"),
          [](gdcm::DataSet*, gdcm::Image* image) { image->GetPixelFormat().SetPixelRepresentation(1); });
  const XrayDicomFile file(path("signed.dcm"));
  EXPECT_EQ(file.frame(0, false).at(1, 0), 2048 + 3);
  EXPECT_EQ(file.frame(0, false).at(2, 0), 2048 - 1);
  EXPECT_EQ(file.fullScale(), 4095);
  EXPECT_TRUE(file.isIntegral());
}

TEST_F(XrayDicomTest, ATableMakesValuesLinear) {
  writeXrayAngiogram(path("run.dcm"), run(1));
  rewrite(path("run.dcm"), path("table.dcm"), [](gdcm::DataSet* data, gdcm::Image*) {
    // Values from 3 on: 1000, 2000, 4000.
    gdcm::Item item;
    const std::uint16_t descriptor[3] = {3, 3, 16};
    const std::uint16_t table[3] = {1000, 2000, 4000};
    gdcm::DataElement first(gdcm::Tag(0x0028, 0x3002), 0, gdcm::VR::US);
    first.SetByteValue(reinterpret_cast<const char*>(descriptor), sizeof descriptor);
    gdcm::DataElement second(gdcm::Tag(0x0028, 0x3006), 0, gdcm::VR::US);
    second.SetByteValue(reinterpret_cast<const char*>(table), sizeof table);
    item.SetVLToUndefined();
    item.GetNestedDataSet().Replace(first);
    item.GetNestedDataSet().Replace(second);
    gdcm::SmartPointer<gdcm::SequenceOfItems> sequence = new gdcm::SequenceOfItems;
    sequence->SetLengthToUndefined();
    sequence->AddItem(item);
    gdcm::DataElement element(gdcm::Tag(0x0028, 0x3000), 0, gdcm::VR::SQ);
    element.SetValue(*sequence);
    element.SetVLToUndefined();
    data->Replace(element);
    set<0x0028, 0x1040>(data, gdcm::CSComp("LOG"));
  });
  const XrayDicomFile file(path("table.dcm"));
  EXPECT_TRUE(file.header().has_lut);
  EXPECT_FALSE(file.isIntegral() && file.fullScale() != 4000);
  const FloatImage frame = file.frame(0, false);
  EXPECT_EQ(frame.at(0, 0), 1000);  // 0, below the first.
  EXPECT_EQ(frame.at(1, 0), 1000);  // 3
  EXPECT_EQ(frame.at(2, 0), 4000);  // 6, above the last.
  EXPECT_FALSE(pixelMeaning(file.header()).is_attenuation);
}

TEST_F(XrayDicomTest, FilesThatAreNoXrayAreRefusedByName) {
  EXPECT_NE(saidOf(path("none.dcm")).find("no such file"), std::string::npos);
  std::ofstream(path("words.dcm")) << "words";
  EXPECT_NE(saidOf(path("words.dcm")).find("words.dcm': it is no DICOM file"), std::string::npos);
  writeXrayAngiogram(path("run.dcm"), run());
  rewrite(path("run.dcm"), path("colour.dcm"), [](gdcm::DataSet*, gdcm::Image* image) {
    // Three of the values of 16 bits are a pixel then.
    image->SetDimension(0, 20);
    image->SetDimension(2, 1);
    image->GetPixelFormat().SetSamplesPerPixel(3);
    image->SetPhotometricInterpretation(gdcm::PhotometricInterpretation::RGB);
  });
  EXPECT_NE(saidOf(path("colour.dcm")).find("one number per pixel"), std::string::npos);
}

TEST_F(XrayDicomTest, ATruncatedFileIsRefused) {
  writeXrayAngiogram(path("run.dcm"), run());
  fs::copy_file(path("run.dcm"), path("cut.dcm"));
  fs::resize_file(path("cut.dcm"), fs::file_size(path("cut.dcm")) - 400);
  const std::string said = saidOf(path("cut.dcm"));
  EXPECT_NE(said.find("cut.dcm"), std::string::npos);
  EXPECT_TRUE(said.find("truncated") != std::string::npos || said.find("damaged") != std::string::npos) << said;
}

TEST_F(XrayDicomTest, WhatFollowsThePixelsIsLeftOut) {
  writeXrayAngiogram(path("run.dcm"), run());
  fs::copy_file(path("run.dcm"), path("padded.dcm"));
  std::ofstream(path("padded.dcm"), std::ios::binary | std::ios::app) << std::string(200, '\0') << "rest";
  const XrayDicomFile expected(path("run.dcm"));
  const XrayDicomFile padded(path("padded.dcm"));
  ASSERT_EQ(padded.header().frames.size(), expected.header().frames.size());
  for (std::size_t i = 0; i < expected.header().frames.size(); ++i) {
    EXPECT_EQ(padded.frame(i, false).pixels, expected.frame(i, false).pixels);
  }
}

TEST_F(XrayDicomTest, AWriterRefusesRunsThatAreNone) {
  EXPECT_THROW(writeXrayAngiogram(path("x.dcm"), XrayAngiogram{}), std::invalid_argument);
  XrayAngiogram uneven = run(1);
  uneven.frames.emplace_back(10, 10);
  EXPECT_THROW(writeXrayAngiogram(path("x.dcm"), uneven), std::invalid_argument);
  EXPECT_THROW(writeXrayAngiogram(path("no/such/folder/x.dcm"), run(1)), XrayDicomError);
}

/// What real files state, as a dump shows it; empty numbers are missing.
struct RealFile {
  const char* name;
  std::size_t frames;
  std::optional<double> source_detector_mm, source_isocentre_mm, pixel_mm, primary_deg, secondary_deg;
  bool pixel_is_estimate;
  const char* missing;  ///< Options that a camera needs.
};

TEST(RealXrayDicomTest, EachIsReadAsItsTagsSay) {
  const char* data = std::getenv("XRAY_REGISTRATION_DATA");
  if (data == nullptr) GTEST_SKIP() << "XRAY_REGISTRATION_DATA does not name the recorded files";
  const fs::path folder = fs::path(data) / "xray_dicom";
  if (!fs::is_directory(folder)) GTEST_SKIP() << folder << " is missing";
  const std::optional<double> none;
  // Of the Loop-X the source is stated as well: 746.519 mm is its distance from the origin along the detector's normal.
  const std::vector<RealFile> files = {
      {"ge_xa_IM1.dcm", 14, 860, 720, 200.0 / 512, 31.3, 0.1, true, ""},
      {"ge_xa_IM5.dcm", 16, 931, 720, 0.390625, -26.5, -32.7, false, ""},
      {"loopx_pelvis_dx.dcm", 1, 1247.53632, 746.51946, 0.3, 5.1394, -1.9920, false, ""},
      {"nema_cr_monochrome1.dcm", 1, none, none, none, 180, 0, false, "--source-detector-mm --pixel-mm"},
      {"nema_xa1_jpeg2000.dcm", 1, none, none, none, none, none, false, "--source-detector-mm --pixel-mm"},
      {"nema_xa1_jpeg_lossless.dcm", 1, none, none, none, none, none, false, "--source-detector-mm --pixel-mm"},
      {"siemens_arcadis_beads_centred.dcm", 1, none, none, 215.0 / 1024, none, none, true, "--source-detector-mm"},
      {"siemens_arcadis_grid_centred.dcm", 1, none, none, 215.0 / 1024, none, none, true, "--source-detector-mm"},
      {"siemens_arcadis_grid_orbit30.dcm", 1, none, none, 215.0 / 1024, none, none, true, "--source-detector-mm"},
      {"siemens_arcadis_spine_centred.dcm", 1, none, none, 215.0 / 1024, none, none, true, "--source-detector-mm"}};
  const auto near = [](const Stated<double>& is, const std::optional<double>& expected) {
    if (!is.value || !expected) return is.value.has_value() == expected.has_value();
    return std::abs(*is.value - *expected) < 1e-4;  // As many digits as stand above.
  };
  for (const RealFile& one : files) {
    SCOPED_TRACE(one.name);
    const XrayDicomFile file((folder / one.name).string());
    const DicomGeometry geometry = dicomGeometry(file.header(), file.header().frames.front());
    EXPECT_EQ(file.header().frames.size(), one.frames);
    EXPECT_TRUE(near(geometry.source_detector_mm, one.source_detector_mm));
    EXPECT_TRUE(near(geometry.source_isocentre_mm, one.source_isocentre_mm));
    EXPECT_TRUE(near(geometry.primary_deg, one.primary_deg));
    EXPECT_TRUE(near(geometry.secondary_deg, one.secondary_deg));
    EXPECT_EQ(geometry.pixel_mm.value.has_value(), one.pixel_mm.has_value());
    if (one.pixel_mm) {
      EXPECT_NEAR((*geometry.pixel_mm.value)[0], *one.pixel_mm, 1e-9);
    }
    EXPECT_EQ(geometry.pixel_mm.estimate, one.pixel_is_estimate);
    std::string missing;
    for (const MissingGeometry& part : geometry.missing) {
      if (!part.for_pose) missing += (missing.empty() ? "" : " ") + part.remedy;
    }
    EXPECT_EQ(missing, one.missing);
    EXPECT_EQ(geometry.camera.has_value(), missing.empty());
  }
}

TEST(RealXrayDicomTest, OnePictureInTwoCompressionsIsTheSame) {
  const char* data = std::getenv("XRAY_REGISTRATION_DATA");
  if (data == nullptr) GTEST_SKIP() << "XRAY_REGISTRATION_DATA does not name the recorded files";
  const std::string start = std::string(data) + "/xray_dicom/nema_xa1_";
  const FloatImage one = XrayDicomFile(start + "jpeg2000.dcm").frame(0, false);
  EXPECT_EQ(one.pixels, XrayDicomFile(start + "jpeg_lossless.dcm").frame(0, false).pixels);
}

}  // namespace
}  // namespace xray_registration
