// DICOM slices as scanners and converters leave them: padding, MONOCHROME1, shared UIDs, sizes that cannot be.
#include <gtest/gtest.h>

#include "test/volume/random_damage.h"
#include "test/volume/reading.h"
#include "test/volume/test_files.h"

namespace xray_registration {
namespace {

using reading::bodyHu;
using reading::expectContains;
using reading::kBodySide;
using reading::kBodySlices;
using reading::read;
using reading::refusal;
using reading::setOutside;
using test_files::DicomFile;
using test_files::TemporaryFolder;

class DicomValues : public testing::Test {
 protected:
  // The body with 1024 added, as stored numbers.
  static std::vector<std::uint16_t> storedBody() { return reading::scaled<std::uint16_t>(bodyHu(), 1.0, 1024.0); }

  static std::vector<DicomFile> series(const std::vector<std::uint16_t>& stored) {
    constexpr int kPixels = kBodySide * kBodySide;
    std::vector<DicomFile> files(kBodySlices);
    for (int i = 0; i < kBodySlices; ++i) {
      DicomFile& file = files[static_cast<std::size_t>(i)];
      file.instance_uid = "1.2.3.1." + std::to_string(i + 1);
      file.position = {-30.0, 15.0, 100.0 + 4.0 * i};
      file.pixel_spacing = {2.0, 3.0};
      file.columns = file.rows = kBodySide;
      file.pixels.assign(stored.begin() + i * kPixels, stored.begin() + (i + 1) * kPixels);
    }
    return files;
  }

  std::string write(const std::vector<DicomFile>& files) const {
    for (std::size_t i = 0; i < files.size(); ++i) writeDicom(folder_ / (std::to_string(i) + ".dcm"), files[i]);
    return folder_.path().string();
  }

  static void expectHu(const Volume& ct, const std::vector<double>& hu) {
    ASSERT_EQ(ct.hu.size(), hu.size());
    for (std::size_t i = 0; i < hu.size(); ++i) ASSERT_EQ(ct.hu[i], hu[i]) << i;
  }

  TemporaryFolder folder_;
};

TEST_F(DicomValues, PaddingIsAirWhateverItsValue) {
  for (const std::uint16_t padding : {63536, 65535, 32768, 4095, 1024, 0}) {
    std::vector<std::uint16_t> stored = storedBody();
    setOutside(padding, &stored);
    stored[12 * 24 + 12] = 4095;   // Metal.
    stored[24 * 24 + 300] = 1024;  // Water.
    std::vector<DicomFile> files = series(stored);
    for (DicomFile& file : files) file.padding = padding;
    const auto [ct, warned, said] = read(write(files));
    std::vector<double> expected = bodyHu();
    setOutside(padding == 0 ? -1024.0 : -1000.0, &expected);  // Air already.
    expected[12 * 24 + 12] = 3071;
    expected[24 * 24 + 300] = 0;
    expectHu(ct, expected);
    EXPECT_EQ(warned, "");
    if (padding != 0) expectContains(said, "voxels are padding");
  }
}

TEST_F(DicomValues, ARangeOfPaddingAndASignedOne) {
  std::vector<std::uint16_t> stored = storedBody();
  setOutside(std::uint16_t{60000}, &stored);
  stored[0] = 60010;
  std::vector<DicomFile> files = series(stored);
  for (DicomFile& file : files) {
    file.padding = 60010;
    file.padding_limit = 60000;
  }
  std::vector<double> expected = bodyHu();
  setOutside(-1000.0, &expected);
  expectHu(read(write(files)).ct, expected);

  stored = storedBody();
  for (auto& value : stored) value = static_cast<std::uint16_t>(value - 1024);  // HU as signed numbers.
  setOutside(std::uint16_t{63536}, &stored);                                    // -2000
  files = series(stored);
  for (DicomFile& file : files) {
    file.is_signed = true;
    file.intercept = 0.0;
    file.padding = 63536;
  }
  setOutside(-2000.0, &expected);
  expectHu(read(write(files)).ct, expected);
}

TEST_F(DicomValues, WithoutTheTagPaddingIsFoundAndSaid) {
  for (const std::uint16_t padding : {63536, 65535, 32768, 4095}) {
    std::vector<std::uint16_t> stored = storedBody();
    setOutside(padding, &stored);
    const auto [ct, warned, said] = read(write(series(stored)));
    std::vector<double> expected = bodyHu();
    setOutside(-1000.0, &expected);
    expectHu(ct, expected);
    expectContains(warned, "padding and taken as air");
  }
}

TEST_F(DicomValues, Monochrome1SaysHowToShowAndChangesNothing) {
  std::vector<DicomFile> files = series(storedBody());
  for (DicomFile& file : files) file.photometric = "MONOCHROME1";
  expectHu(read(write(files)).ct, bodyHu());
}

TEST_F(DicomValues, WithoutRescaleTagsTheHistogramSpeaks) {
  std::vector<DicomFile> files = series(storedBody());
  for (DicomFile& file : files) file.has_rescale = false;
  expectContains(refusal(write(files)), "ct/hu_intercept: -1024");
  VolumeReadOptions options;
  options.hu_intercept = -1024.0;
  expectHu(read(write(files), options).ct, bodyHu());
}

// GDCM's own reader ends the process on each of these.
TEST_F(DicomValues, WhatGdcmAssertsIsRefused) {
  std::vector<DicomFile> files = series(storedBody());
  for (DicomFile& file : files) file.slope = 0.0;
  expectContains(refusal(write(files)), "RescaleSlope");
  files = series(storedBody());
  for (DicomFile& file : files) file.photometric = "MONOCHROME7";
  expectContains(refusal(write(files)), "its pixels cannot be read");
}

TEST_F(DicomValues, AnotherKindOfValueIsWarnedOf) {
  std::vector<DicomFile> files = series(storedBody());
  for (DicomFile& file : files) file.rescale_type = "US";
  expectContains(read(write(files)).warned, "'US' as the kind of its values");
  for (DicomFile& file : files) file.rescale_type = "HU";
  EXPECT_EQ(read(write(files)).warned, "");
}

TEST_F(DicomValues, SlicesThatShareOneInstanceUidAreAllTaken) {
  std::vector<DicomFile> files = series(storedBody());
  for (DicomFile& file : files) file.instance_uid = "1.2.3.1.1";
  const auto [ct, warned, said] = read(write(files));
  expectHu(ct, bodyHu());
  expectContains(warned, "11 of its slices have the instance UID of another");
}

TEST_F(DicomValues, TwoPhasesWithTheSameUidsAreNoCopies) {
  std::vector<DicomFile> files = series(storedBody());
  std::vector<DicomFile> both = files;
  for (DicomFile& file : files) {
    file.pixels[300] = 2000;
    both.push_back(file);
  }
  expectContains(refusal(write(both)), "several slices lie in one place");
}

TEST_F(DicomValues, ASizeThatTheFileCannotHoldIsRefused) {
  std::vector<DicomFile> files = series(storedBody());
  for (DicomFile& file : files) file.rows = file.columns = 65535;
  expectContains(refusal(write(files)), "truncated or damaged");
}

// As some media leave them.
TEST_F(DicomValues, WhatFollowsThePixelsIsLeftOut) {
  const std::vector<DicomFile> files = series(storedBody());
  write(files);
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::ofstream(folder_ / (std::to_string(i) + ".dcm"), std::ios::binary | std::ios::app) << std::string(200, '\0');
  }
  expectHu(read(folder_.path().string()).ct, bodyHu());
}

// The file is long enough, its pixels are not: GDCM would read on behind them.
TEST_F(DicomValues, PixelsThatAreFewerThanTheSizeNeedsAreRefused) {
  std::vector<DicomFile> files = series(storedBody());
  for (DicomFile& file : files) ++file.rows;
  expectContains(refusal(write(files)), "truncated or damaged");
}

TEST_F(DicomValues, AFileThatIsCutOffAnywhereIsLeftOutOrRefused) {
  std::vector<DicomFile> files = series(storedBody());
  files.resize(3);
  const std::string folder = write(files);
  const std::string last = folder_ / "2.dcm";
  const auto size = static_cast<int>(std::filesystem::file_size(last));
  std::ifstream stream(last, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  for (int length = 100; length < size; length += length < 1000 ? 1 : 101) {
    test_files::writeBytes(last, bytes.substr(0, static_cast<std::size_t>(length)));
    std::string warned;
    std::string refused;
    try {
      const auto result = read(folder);
      warned = result.warned;
      EXPECT_EQ(result.ct.grid.size.z(), 2);
    } catch (const VolumeError& error) {
      refused = error.what();
    }
    // Before the mark of DICOM it is another file; without its series it is another series.
    const bool is_told = warned.find("cut off or damaged") != std::string::npos ||
                         refused.find("truncated or damaged") != std::string::npos;
    EXPECT_TRUE(is_told || length < 600) << length << ": " << warned << refused;
  }
}

TEST_F(DicomValues, DamagedHeadersAreReadOrRefused) {
  std::vector<DicomFile> files = series(storedBody());
  files.resize(3);
  for (DicomFile& file : files) file.padding = 63536;
  const std::string folder = write(files);
  const std::size_t header = std::filesystem::file_size(folder_ / "2.dcm") - 2 * kBodySide * kBodySide;
  reading::expectDamageIsReadOrRefused(folder, folder_ / "2.dcm", header);
}

TEST_F(DicomValues, ALengthThatTheFileCannotHoldIsRefused) {
  const std::string folder = write(series(storedBody()));
  std::ifstream stream(folder_ / "11.dcm", std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  const std::size_t pixels = bytes.find(std::string("\xe0\x7f\x10\0OW", 6));
  bytes.replace(pixels + 8, 4, "\xf0\xff\xff\xef");
  test_files::writeBytes(folder_ / "11.dcm", bytes);
  expectContains(refusal(folder), "truncated or damaged");
}

TEST_F(DicomValues, ZeroSpacingIsRefused) {
  std::vector<DicomFile> files = series(storedBody());
  for (DicomFile& file : files) file.pixel_spacing = {2.0, 0.0};
  expectContains(refusal(write(files)), "not positive");
}

}  // namespace
}  // namespace xray_registration
