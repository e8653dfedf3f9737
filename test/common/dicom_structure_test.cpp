#include "xray_registration/common/dicom_structure.h"

#include <gtest/gtest.h>

#include "test/volume/test_files.h"

namespace xray_registration {
namespace {

using test_files::DicomFile;
using test_files::TemporaryFolder;
using test_files::writeBytes;

std::string littleEndian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i) & 0xff);
  return text;
}

std::string tag(int group, int number) {
  return littleEndian(static_cast<std::uint32_t>(group), 2) + littleEndian(static_cast<std::uint32_t>(number), 2);
}

// An element of a data set whose VR is not written.
std::string implicitElement(int group, int number, const std::string& value) {
  return tag(group, number) + littleEndian(static_cast<std::uint32_t>(value.size()), 4) + value;
}

const std::string kOpen(4, '\xff');
const std::string kItemEnd = tag(0xfffe, 0xe00d) + std::string(4, '\0');
const std::string kSequenceEnd = tag(0xfffe, 0xe0dd) + std::string(4, '\0');

class DicomStructureTest : public testing::Test {
 protected:
  DicomStructure look(const std::string& bytes) const {
    writeBytes(folder_ / "a", bytes);
    return dicomStructure(folder_ / "a");
  }

  std::string slice() const {
    DicomFile file;
    file.columns = 4;
    file.rows = 4;
    file.pixels.resize(16);
    writeDicom(folder_ / "slice", file);
    std::ifstream stream(folder_ / "slice", std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  // Explicit VR elements, before the pixels.
  std::string sliceWith(const std::string& elements) const {
    std::string bytes = slice();
    return bytes.insert(bytes.size() - 44, elements);
  }

  TemporaryFolder folder_;
};

TEST_F(DicomStructureTest, AWholeFile) {
  const DicomStructure found = look(slice());
  EXPECT_TRUE(found.is_dicom);
  EXPECT_TRUE(found.is_whole);
  EXPECT_TRUE(found.pixels_fit);
}

TEST_F(DicomStructureTest, OtherFilesAreNone) {
  EXPECT_FALSE(look("").is_dicom);
  EXPECT_FALSE(look("notes\n").is_dicom);
  EXPECT_FALSE(look(std::string(5000, 'x')).is_dicom);
}

TEST_F(DicomStructureTest, CutOffAnywhere) {
  const std::string bytes = slice();
  int whole = 0;
  for (std::size_t length = 132; length < bytes.size(); ++length) {
    const DicomStructure found = look(bytes.substr(0, length));
    EXPECT_TRUE(found.is_dicom);
    // The pixels: 12 bytes of their element, 32 of their own.
    if (length >= bytes.size() - 32) {
      EXPECT_TRUE(found.is_whole) << length;
      EXPECT_FALSE(found.pixels_fit) << length;
    } else {
      whole += found.is_whole ? 1 : 0;
    }
  }
  // Where one of the elements ends; there are some twenty.
  EXPECT_GT(whole, 10);
  EXPECT_LT(whole, 30);
}

TEST_F(DicomStructureTest, ALengthBeyondTheFile) {
  EXPECT_FALSE(look(sliceWith(tag(0x29, 0x1010) + "OB" + std::string(2, '\0') + "\xf0\xff\xff\xef")).is_whole);
  EXPECT_TRUE(look(sliceWith(tag(0x29, 0x1010) + "OB" + std::string(2, '\0') + littleEndian(2, 4) + "ab")).is_whole);
}

TEST_F(DicomStructureTest, ElementsAreInTheirOrder) {
  EXPECT_TRUE(look(sliceWith(tag(0x29, 0x1010) + "CS" + littleEndian(2, 2) + "ab")).is_whole);
  EXPECT_FALSE(look(sliceWith(tag(0x8, 0x60) + "CS" + littleEndian(2, 2) + "CT")).is_whole);
  EXPECT_FALSE(look(sliceWith(tag(0xff28, 0x101) + "CS" + littleEndian(2, 2) + "ab")).pixels_fit);
}

TEST_F(DicomStructureTest, SequencesOfEveryKind) {
  const std::string inner = tag(0x8, 0x60) + "CS" + littleEndian(2, 2) + "CT";
  const std::string item = tag(0xfffe, 0xe000);
  const std::string open_item = item + kOpen + inner + kItemEnd;
  const std::string closed_item = item + littleEndian(static_cast<std::uint32_t>(inner.size()), 4) + inner;
  const std::string sequence = tag(0x29, 0x1010) + "SQ" + std::string(2, '\0');
  for (const std::string& one : {open_item, closed_item}) {
    EXPECT_TRUE(look(sliceWith(sequence + kOpen + one + one + kSequenceEnd)).is_whole);
    EXPECT_TRUE(look(sliceWith(sequence + littleEndian(static_cast<std::uint32_t>(one.size()), 4) + one)).is_whole);
    EXPECT_FALSE(
        look(sliceWith(sequence + littleEndian(static_cast<std::uint32_t>(one.size()) + 1, 4) + one)).is_whole);
  }
  const std::string nested =
      sequence + kOpen + item + kOpen + sequence + kOpen + open_item + kSequenceEnd + kItemEnd + kSequenceEnd;
  EXPECT_TRUE(look(sliceWith(nested)).is_whole);
  // One of unknown VR and length is implicit within.
  const std::string unknown = tag(0x29, 0x1010) + "UN" + std::string(2, '\0') + kOpen + item + kOpen +
                              implicitElement(0x8, 0x60, "CT") + kItemEnd + kSequenceEnd;
  EXPECT_TRUE(look(sliceWith(unknown)).is_whole);
  // An icon's packed pixels are no elements.
  const std::string icon =
      tag(0x29, 0x1010) + "OB" + std::string(2, '\0') + kOpen + item + littleEndian(3, 4) + "xyz" + kSequenceEnd;
  EXPECT_TRUE(look(sliceWith(icon)).is_whole);
  // Deeper than any file goes.
  std::string deep;
  for (int i = 0; i < 1000; ++i) deep += sequence + kOpen + item + kOpen;
  EXPECT_FALSE(look(sliceWith(deep)).is_whole);
}

TEST_F(DicomStructureTest, PackedPixelsWithAndWithoutTheirEnd) {
  const std::string bytes = slice();
  const std::string pixels = tag(0x7fe0, 0x10) + "OB" + std::string(2, '\0') + kOpen + tag(0xfffe, 0xe000) +
                             littleEndian(0, 4) + tag(0xfffe, 0xe000) + littleEndian(4, 4) + "abcd";
  std::string header = bytes.substr(0, bytes.size() - 44);
  // Of pixels that are not packed GDCM would take what comes for the lengths of fragments.
  EXPECT_FALSE(look(header + pixels + kSequenceEnd).pixels_fit);
  header.replace(header.find("1.2.840.10008.1.2.1"), 19, "1.2.840.10008.1.2.5");
  EXPECT_TRUE(look(header + pixels + kSequenceEnd).pixels_fit);
  EXPECT_FALSE(look(header + pixels).pixels_fit);
  EXPECT_FALSE(look(header + pixels.substr(0, pixels.size() - 1)).pixels_fit);
}

// Padding, or whatever a medium added; it is not given to GDCM.
TEST_F(DicomStructureTest, WhatComesBehindThePixels) {
  const std::string bytes = slice();
  for (const std::string& rest : {std::string(), std::string(100, '\0'), std::string("rest")}) {
    const DicomStructure found = look(bytes + rest);
    EXPECT_TRUE(found.pixels_fit);
    EXPECT_EQ(found.image_bytes, bytes.size());
  }
  EXPECT_EQ(dicomBeginning(folder_ / "a", 7), bytes.substr(0, 7));
}

TEST_F(DicomStructureTest, WhereThePixelsBeginAndHowLongTheyAre) {
  const std::string bytes = slice();
  const DicomStructure found = look(bytes);
  EXPECT_EQ(found.header_bytes, bytes.size() - 44);
  EXPECT_EQ(found.pixel_bytes, 32U);
  const DicomStructure without = look(bytes.substr(0, bytes.size() - 44));
  EXPECT_EQ(without.header_bytes, bytes.size() - 44);
  EXPECT_FALSE(without.pixel_bytes);
}

TEST_F(DicomStructureTest, PixelsOfAnotherKindOrWithoutAHeaderAreNone) {
  const std::string whole = slice();
  std::string sequence = whole;
  sequence.replace(whole.size() - 40, 2, "SQ");
  EXPECT_FALSE(look(sequence).is_whole);
  const std::size_t meta_end = whole.find(tag(0x8, 0x16));
  ASSERT_NE(meta_end, std::string::npos);
  EXPECT_FALSE(look(whole.substr(0, meta_end) + whole.substr(whole.size() - 44)).is_whole);
}

// A few kilobytes of it can hold gigabytes, which GDCM would unpack.
TEST_F(DicomStructureTest, DeflatedOnesAreNotLookedInto) {
  std::string bytes = slice();
  const std::string plain(
      "UI\x14\0"
      "1.2.840.10008.1.2.1\0",
      24);
  const std::size_t at = bytes.find(plain);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, plain.size(),
                std::string("UI\x16\0"
                            "1.2.840.10008.1.2.1.99",
                            26));
  const DicomStructure found = look(bytes);
  EXPECT_TRUE(found.is_dicom);
  EXPECT_TRUE(found.is_deflated);
  EXPECT_FALSE(found.is_whole);
  EXPECT_FALSE(found.pixels_fit);
}

// GDCM ends the process on them.
TEST_F(DicomStructureTest, PixelsThatCannotBe) {
  const std::string bytes = slice();
  const auto with = [&](int number, std::uint32_t value) {
    const std::string element = tag(0x28, number) + "US" + littleEndian(2, 2);
    std::string changed = bytes;
    const std::size_t at = changed.find(element);
    EXPECT_NE(at, std::string::npos) << number;
    if (at != std::string::npos) changed.replace(at + element.size(), 2, littleEndian(value, 2));
    return look(changed).is_whole;
  };
  EXPECT_TRUE(with(0x100, 16));
  EXPECT_FALSE(with(0x100, 61));
  EXPECT_FALSE(with(0x100, 0));
  EXPECT_FALSE(with(0x2, 250));
  EXPECT_FALSE(with(0x101, 65));
}

TEST_F(DicomStructureTest, ImplicitWithoutAPreamble) {
  const std::string bytes = implicitElement(0x8, 0x60, "CT") + implicitElement(0x28, 0x10, std::string("\4\0", 2));
  EXPECT_TRUE(look(bytes).is_dicom);
  EXPECT_TRUE(look(bytes).is_whole);
  EXPECT_FALSE(look(bytes.substr(0, bytes.size() - 1)).is_whole);
}

}  // namespace
}  // namespace xray_registration
