#include "xray_registration/volume/segment_names.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "test_files.h"
#include "xray_registration/volume/volume_error.h"
#include "xray_registration/volume/volume_io.h"

namespace xray_registration {
namespace {

using namespace test_files;

std::string messageOf(const std::function<void()>& work) {
  try {
    work();
  } catch (const VolumeError& error) {
    return error.what();
  }
  return "no VolumeError";
}

// As 3D Slicer 5 writes them, shortened; 4 × 3 × 2 voxels.
std::string segNrrd(const std::vector<std::string>& segment_keys, bool in_layers = false) {
  std::string bytes =
      "NRRD0004\n# Complete NRRD file format specification at:\n# http://teem.sourceforge.net/nrrd/format.html\n"
      "type: unsigned char\n";
  bytes += in_layers
               ? "dimension: 4\nspace: left-posterior-superior\nsizes: 2 4 3 2\nkinds: list domain domain domain\n"
                 "space directions: none (1,0,0) (0,1,0) (0,0,2.5)\n"
               : "dimension: 3\nspace: left-posterior-superior\nsizes: 4 3 2\nkinds: domain domain domain\n"
                 "space directions: (1,0,0) (0,1,0) (0,0,2.5)\n";
  bytes +=
      "encoding: raw\nspace origin: (5,6,7)\n"
      "Segmentation_ContainedRepresentationNames:=Binary labelmap|Closed surface|\nSegment0_Color:=0.5 0.68 0.5\n";
  for (const std::string& key : segment_keys) bytes += key + "\n";
  bytes += "\n";
  for (int i = 0; i < (in_layers ? 48 : 24); ++i) bytes += static_cast<char>(i % 3);
  return bytes;
}

const std::vector<std::string> kTwoSegments = {
    "Segment0_ID:=Segment_1", "Segment0_Name:=vertebrae T12", "Segment0_LabelValue:=2", "Segment0_Layer:=0",
    "Segment1_Name:=T11",     "Segment1_LabelValue:=1",       "Segment1_Layer:=0"};

class SegmentNames : public testing::Test {
 protected:
  std::string file(const std::string& bytes) {
    std::string path = folder_ / "spine.seg.nrrd";
    writeBytes(path, bytes);
    return path;
  }

  TemporaryFolder folder_;
};

TEST_F(SegmentNames, AreReadWithTheirLabels) {
  const std::string path = file(segNrrd(kTwoSegments));
  const std::map<std::string, int> expected = {{"T11", 1}, {"vertebrae T12", 2}};
  EXPECT_EQ(segmentNames(path), expected);
  EXPECT_EQ(labelsNamed({"vertebrae T12", "T11"}, path), (std::vector<int>{2, 1}));
  const LabelVolume labels = readLabels(path, {}, {});
  EXPECT_EQ(labels.grid.size, Eigen::Vector3i(4, 3, 2));
  EXPECT_EQ(labels.labels[5], 2);
}

TEST_F(SegmentNames, OtherFilesHaveNone) {
  EXPECT_TRUE(segmentNames(file(segNrrd({}))).empty());
  writeBytes(folder_ / "a.nii", std::string("Segment0_Name:=T12\nSegment0_LabelValue:=2\n"));
  EXPECT_TRUE(segmentNames(folder_ / "a.nii").empty());
}

TEST_F(SegmentNames, TheDataAreNotReadAsHeader) {
  EXPECT_EQ(segmentNames(file(segNrrd(kTwoSegments) + "\nSegment2_Name:=L1\nSegment2_LabelValue:=3\n")).size(), 2U);
}

// A regular expression of the standard library's would take the whole stack.
TEST_F(SegmentNames, LongOnesAndDamagedKeys) {
  const std::string name(200000, 'n');
  EXPECT_EQ(segmentNames(file(segNrrd({"Segment0_Name:=" + name, "Segment0_LabelValue:=7"}))).at(name), 7);
  for (const char* key : {"Segment_Name:=a", "Segment0000001_Name:=a", "Segment0Name:=a", "Segment0_Name=a",
                          "Segment0_Names:=a", "SegmentX_Name:=a", "Segment:=a_Name"}) {
    EXPECT_TRUE(segmentNames(file(segNrrd({key, "Segment0_LabelValue:=7"}))).empty()) << key;
  }
  const std::string path = file(segNrrd({"Segment0_Name:=a", "Segment0_LabelValue:=0x1"}));
  EXPECT_NE(messageOf([&] { segmentNames(path); }).find("which is no number"), std::string::npos);
}

TEST_F(SegmentNames, OverlappingSegmentsAreRefusedWithTheRemedy) {
  std::vector<std::string> layered = kTwoSegments;
  layered.back() = "Segment1_Layer:=1";
  const std::string path = file(segNrrd(layered, true));
  EXPECT_NE(messageOf([&] { segmentNames(path); }).find("layers"), std::string::npos);
  EXPECT_NE(messageOf([&] { readLabels(path, {}, {}); }).find("export them as a label map"), std::string::npos);
  // As before layers were known: a volume per segment.
  const std::string old = file(segNrrd({"Segment0_Name:=a", "Segment1_Name:=b"}, true));
  EXPECT_NE(messageOf([&] { readLabels(old, {}, {}); }).find("label map"), std::string::npos);
}

TEST_F(SegmentNames, RefusalsNameFileAndWhatIsThere) {
  const std::string path = file(segNrrd(kTwoSegments));
  const std::string unknown = messageOf([&] { labelsNamed({"T10"}, path); });
  for (const char* word : {"spine.seg.nrrd", "'T10'", "T11, vertebrae T12"}) {
    EXPECT_NE(unknown.find(word), std::string::npos) << unknown;
  }
  const std::string nameless = messageOf([&] { labelsNamed({"T10"}, file(segNrrd({}))); });
  EXPECT_NE(nameless.find("as numbers"), std::string::npos);
  std::vector<std::string> twice = kTwoSegments;
  twice[4] = "Segment1_Name:=vertebrae T12";
  EXPECT_NE(messageOf([&] { segmentNames(file(segNrrd(twice))); }).find("two of its segments"), std::string::npos);
  std::vector<std::string> worded = kTwoSegments;
  worded[2] = "Segment0_LabelValue:=two";
  EXPECT_NE(messageOf([&] { segmentNames(file(segNrrd(worded))); }).find("'two'"), std::string::npos);
  EXPECT_NE(messageOf([&] { segmentNames(folder_ / "missing.seg.nrrd"); }).find("no such file"), std::string::npos);
}

}  // namespace
}  // namespace xray_registration
