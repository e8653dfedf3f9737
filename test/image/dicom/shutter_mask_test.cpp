#include <gtest/gtest.h>

#include <algorithm>

#include "xray_registration/image/xray_dicom.h"

namespace xray_registration {
namespace {

DicomHeader header(int width, int height) {
  DicomHeader header;
  header.width = width;
  header.height = height;
  return header;
}

std::size_t seen(const MaskImage& mask) {
  return static_cast<std::size_t>(std::count(mask.pixels.begin(), mask.pixels.end(), 255));
}

TEST(ShutterMaskTest, EdgesAreColumnsAndRowsFromOne) {
  DicomFrame frame;
  frame.shutter.rectangle = DicomShutter::Rectangle{3, 8, 2, 5};
  const MaskImage mask = shutterMask(header(10, 6), frame);
  ASSERT_EQ(mask.width, 10);
  EXPECT_EQ(mask.at(1, 1), 0);
  EXPECT_EQ(mask.at(2, 1), 255);
  EXPECT_EQ(mask.at(7, 4), 255);
  EXPECT_EQ(mask.at(8, 4), 0);
  EXPECT_EQ(mask.at(7, 5), 0);
  EXPECT_EQ(seen(mask), 6U * 4U);
}

TEST(ShutterMaskTest, CircleAndCollimatorBothCover) {
  DicomFrame frame;
  frame.shutter.circle = DicomShutter::Circle{50, 40, 20};  // Row, column.
  const MaskImage round = shutterMask(header(80, 100), frame);
  EXPECT_EQ(round.at(39, 49), 255);
  EXPECT_EQ(round.at(39, 69), 255);
  EXPECT_EQ(round.at(39, 70), 0);
  EXPECT_NEAR(seen(round), 3.14159 * 400, 20);  // The border's pixels are in or out.
  frame.collimator.rectangle = DicomShutter::Rectangle{1, 40, 1, 100};
  EXPECT_EQ(shutterMask(header(80, 100), frame).at(45, 49), 0);
}

TEST(ShutterMaskTest, PolygonsAreRowsAndColumns) {
  DicomFrame frame;
  frame.shutter.polygon = {{10, 30}, {40, 30}, {40, 90}, {10, 90}};
  const MaskImage mask = shutterMask(header(100, 50), frame);
  EXPECT_EQ(mask.at(60, 20), 255);
  EXPECT_EQ(mask.at(20, 20), 0);
  EXPECT_EQ(mask.at(60, 45), 0);
}

TEST(ShutterMaskTest, WhatCoversNothingOrAllIsNoMask) {
  DicomFrame frame;
  EXPECT_TRUE(shutterMask(header(100, 100), frame).empty());
  frame.shutter.rectangle = DicomShutter::Rectangle{-5, 200, 1, 100};
  EXPECT_TRUE(shutterMask(header(100, 100), frame).empty());
  frame.shutter.rectangle = DicomShutter::Rectangle{1, 1, 1, 100};
  EXPECT_TRUE(shutterMask(header(100, 100), frame).empty());
}

}  // namespace
}  // namespace xray_registration
