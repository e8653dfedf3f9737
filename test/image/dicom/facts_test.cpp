#include "image/dicom/facts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "image/dicom/frame_times.h"
#include "image/dicom/tags.h"

namespace xray_registration::dicom {
namespace {

Element numbers(std::vector<double> values) {
  Element element;
  element.numbers = std::move(values);
  return element;
}

Element words(std::vector<std::string> values) {
  Element element;
  element.words = std::move(values);
  return element;
}

Element items(std::vector<DataSet> sets) {
  Element element;
  element.items = std::move(sets);
  return element;
}

/// A functional group: the macro's sequence with one item.
DataSet group(Tag macro, std::map<Tag, Element> attributes) {
  DataSet item, inner;
  inner.elements = std::move(attributes);
  item.elements[macro] = items({inner});
  return item;
}

constexpr Tag kSharedGroups = 0x52009229, kFrameGroups = 0x52009230;
constexpr Tag kXrayGeometrySequence = 0x00189476, kPositionerPositionSequence = 0x00189405;
constexpr Tag kFrameContentSequence = 0x00209111;

// As text, and as the bits of a double, an attribute can be NaN or infinite.
TEST(FactsTest, NumbersThatAreNotFiniteAreNotStated) {
  const double infinity = std::numeric_limits<double>::infinity();
  DataSet file;
  file.elements[tag::kDistanceSourceToDetector] = numbers({infinity});
  file.elements[tag::kImagerPixelSpacing] = numbers({0.3, std::nan("")});
  file.elements[tag::kPositionerPrimaryAngle] = numbers({-infinity});
  const DicomHeader header = headerOf(file, 1);
  EXPECT_FALSE(header.frames[0].source_detector_mm);
  EXPECT_FALSE(header.frames[0].imager_spacing_mm);
  EXPECT_FALSE(header.frames[0].primary_deg);
}

TEST(FactsTest, ATimeWithAnyNumberOfDigits) { EXPECT_EQ(secondsOfDay("000001." + std::string(400, '0') + "1"), 1.0); }

// Each frame half a day before the last one: looked at in a moment, however many there are.
TEST(FactsTest, ManyMidnights) {
  DataSet file;
  std::vector<DataSet> groups;
  for (int i = 0; i < 20000; ++i) {
    const char* instant = i % 2 == 0 ? "20211124180000" : "20211124060000";
    groups.push_back(group(kFrameContentSequence, {{tag::kFrameAcquisitionDateTime, words({instant})}}));
  }
  file.elements[kFrameGroups] = items(groups);
  const DicomHeader header = headerOf(file, groups.size());
  EXPECT_EQ(header.frames.back().time_s, 19999 * 43200.0);
}

TEST(FactsTest, AngiographyStatesItsGeometryOnce) {
  DataSet file;
  file.elements[tag::kDistanceSourceToDetector] = numbers({931});
  file.elements[tag::kDistanceSourceToPatient] = numbers({720});
  file.elements[tag::kImagerPixelSpacing] = numbers({0.3, 0.4});
  file.elements[tag::kPositionerPrimaryAngle] = numbers({-26.5});
  file.elements[tag::kPositionerSecondaryAngle] = numbers({-32.7});
  file.elements[tag::kFieldOfViewRotation] = numbers({90});
  file.elements[tag::kFieldOfViewHorizontalFlip] = words({"YES"});
  const DicomHeader header = headerOf(file, 2);
  ASSERT_EQ(header.frames.size(), 2U);
  for (const DicomFrame& frame : header.frames) {
    EXPECT_EQ(frame.source_detector_mm, 931);
    EXPECT_EQ(frame.source_isocentre_mm, 720);
    EXPECT_EQ(frame.imager_spacing_mm, (RowColumn{0.3, 0.4}));
    EXPECT_EQ(frame.primary_deg, -26.5);
    EXPECT_EQ(frame.secondary_deg, -32.7);
    EXPECT_EQ(frame.field_rotation_deg, 90);
    EXPECT_EQ(frame.field_flipped, true);
  }
}

TEST(FactsTest, ZeroIsNoLengthButAnAngle) {
  DataSet file;
  file.elements[tag::kDistanceSourceToDetector] = numbers({0});
  file.elements[tag::kImagerPixelSpacing] = numbers({0, 0.2});
  file.elements[tag::kPositionerPrimaryAngle] = numbers({0});
  const DicomFrame frame = headerOf(file, 1).frames.front();
  EXPECT_FALSE(frame.source_detector_mm);
  EXPECT_FALSE(frame.imager_spacing_mm);
  EXPECT_EQ(frame.primary_deg, 0.0);
}

TEST(FactsTest, AMovingPositionerHasIncrements) {
  DataSet file;
  file.elements[tag::kPositionerPrimaryAngle] = numbers({10});
  file.elements[tag::kPositionerPrimaryAngleIncrement] = numbers({0, 1.5, 4});
  const DicomHeader header = headerOf(file, 3);
  EXPECT_EQ(header.frames[0].primary_deg, 10.0);
  EXPECT_EQ(header.frames[1].primary_deg, 11.5);
  EXPECT_EQ(header.frames[2].primary_deg, 14.0);
}

TEST(FactsTest, EnhancedFramesHaveGroupsOfTheirOwn) {
  DataSet file;
  file.elements[tag::kDistanceSourceToDetector] = numbers({1});
  file.elements[kSharedGroups] =
      items({group(kXrayGeometrySequence, {{tag::kDistanceSourceToDetector, numbers({1200})},
                                           {tag::kDistanceSourceToIsocenter, numbers({785})}})});
  DataSet first = group(kPositionerPositionSequence, {{tag::kPositionerPrimaryAngle, numbers({20})},
                                                      {tag::kPositionerSecondaryAngle, numbers({5})}});
  DataSet second = group(kPositionerPositionSequence, {{tag::kPositionerPrimaryAngle, numbers({22})}});
  second.elements[kXrayGeometrySequence] =
      group(kXrayGeometrySequence, {{tag::kDistanceSourceToDetector, numbers({1190})}}).elements[kXrayGeometrySequence];
  file.elements[kFrameGroups] = items({first, second});
  const DicomHeader header = headerOf(file, 2);
  EXPECT_EQ(header.frames[0].source_detector_mm, 1200);  // Shared, before the file's.
  EXPECT_EQ(header.frames[1].source_detector_mm, 1190);  // Its own, before what is shared.
  EXPECT_EQ(header.frames[0].source_isocentre_mm, 785);
  EXPECT_EQ(header.frames[0].primary_deg, 20.0);
  EXPECT_EQ(header.frames[1].primary_deg, 22.0);
  EXPECT_FALSE(header.frames[1].secondary_deg);  // Another frame's is not taken.
}

TEST(FactsTest, ShuttersOfAllShapes) {
  DataSet file;
  file.elements[tag::kShutter] = words({"RECTANGULAR", "CIRCULAR"});
  file.elements[tag::kShutter + 0x02] = numbers({8});
  file.elements[tag::kShutter + 0x04] = numbers({508});
  file.elements[tag::kShutter + 0x06] = numbers({6});
  file.elements[tag::kShutter + 0x08] = numbers({506});
  file.elements[tag::kShutter + 0x10] = numbers({100, 200});
  file.elements[tag::kShutter + 0x12] = numbers({50});
  file.elements[tag::kCollimator] = words({"POLYGONAL"});
  file.elements[tag::kCollimator + 0x20] = numbers({1, 2, 3, 4, 5, 6});
  const DicomFrame frame = headerOf(file, 1).frames.front();
  ASSERT_TRUE(frame.shutter.rectangle && frame.shutter.circle);
  EXPECT_EQ(frame.shutter.rectangle->right, 508);
  EXPECT_EQ(frame.shutter.rectangle->upper, 6);
  EXPECT_EQ(frame.shutter.circle->row, 100);
  EXPECT_EQ(frame.shutter.circle->column, 200);
  EXPECT_FALSE(frame.collimator.rectangle);
  EXPECT_EQ(frame.collimator.polygon, (std::vector<RowColumn>{{1, 2}, {3, 4}, {5, 6}}));
}

TEST(FactsTest, TimesBetweenFramesAddUp) {
  DataSet file;
  file.elements[tag::kFrameTimeVector] = numbers({0, 40, 60});
  file.elements[tag::kFrameTime] = numbers({1});
  const DicomHeader header = headerOf(file, 3);
  EXPECT_DOUBLE_EQ(header.frames[1].time_s, 0.04);
  EXPECT_DOUBLE_EQ(header.frames[2].time_s, 0.1);
  EXPECT_NE(header.time_source.find("FrameTimeVector"), std::string::npos);
}

TEST(FactsTest, OneTimeForAllFramesOrARate) {
  DataSet file;
  file.elements[tag::kCineRate] = numbers({25});
  EXPECT_DOUBLE_EQ(headerOf(file, 3).frames[2].time_s, 0.08);
  file.elements[tag::kFrameTime] = numbers({66.6667});
  EXPECT_DOUBLE_EQ(headerOf(file, 3).frames[2].time_s, 0.1333334);
  EXPECT_EQ(headerOf(DataSet{}, 3).time_source, "");
}

TEST(FactsTest, InstantsOfEnhancedFramesGoPastMidnight) {
  DataSet file;
  const auto at = [](const char* instant) {
    return group(kFrameContentSequence, {{tag::kFrameAcquisitionDateTime, words({instant})}});
  };
  file.elements[kFrameGroups] =
      items({at("20240131235959.5+0100"), at("20240131235959.9+0100"), at("20240201000000.4")});
  const DicomHeader header = headerOf(file, 3);
  EXPECT_NEAR(header.frames[1].time_s, 0.4, 1e-9);
  EXPECT_NEAR(header.frames[2].time_s, 0.9, 1e-9);
}

TEST(FactsTest, TimesOfDay) {
  EXPECT_EQ(secondsOfDay("132359.25"), 13 * 3600 + 23 * 60 + 59.25);
  EXPECT_EQ(secondsOfDay("13:23:59"), 13 * 3600 + 23 * 60 + 59);
  EXPECT_EQ(secondsOfDay("1323"), 13 * 3600 + 23 * 60);
  EXPECT_FALSE(secondsOfDay(""));
  EXPECT_FALSE(secondsOfDay("noon"));
  EXPECT_FALSE(secondsOfDay("13235"));
}

}  // namespace
}  // namespace xray_registration::dicom
