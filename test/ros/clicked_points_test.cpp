#include "ros/clicked_points.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

using State = ShownLandmark::State;

TEST(ClickedPoints, PairsPointsWithThePixelsAfterThem) {
  ClickedPoints clicked;
  clicked.addPoint({1, 2, 3});
  EXPECT_EQ(clicked.pairCount(), 0U);
  EXPECT_EQ(clicked.shown().at(0).state, State::kWaiting);
  clicked.addPixel("", {10, 20});
  clicked.addPoint({4, 5, 6});
  clicked.addPixel("", {30, 40});
  const std::vector<SeenPoint> seen = clicked.seen();
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].point_ct, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(seen[0].pixel, Eigen::Vector2d(10, 20));
  EXPECT_EQ(seen[1].point_ct, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(seen[1].pixel, Eigen::Vector2d(30, 40));
}

TEST(ClickedPoints, PairsPixelsWithThePointsAfterThem) {
  ClickedPoints clicked;
  for (int i = 0; i < 3; ++i) {
    clicked.addPixel("", {10.0 * i, 1});
    clicked.addPoint({1.0 * i, 0, 0});
  }
  const std::vector<SeenPoint> seen = clicked.seen();
  ASSERT_EQ(seen.size(), 3U);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(seen[i].point_ct.x(), i);
    EXPECT_EQ(seen[i].pixel.x(), 10.0 * i);
  }
}

TEST(ClickedPoints, GivesAPointItsPixelsInSeveralViews) {
  ClickedPoints clicked;
  clicked.addPoint({1, 0, 0});
  clicked.addPixel("ap", {1, 1});
  clicked.addPixel("lateral", {2, 2});
  clicked.addPoint({2, 0, 0});
  clicked.addPixel("lateral", {3, 3});
  const std::vector<SeenPoint> seen = clicked.seen();
  ASSERT_EQ(seen.size(), 3U);
  EXPECT_EQ(seen[1].view, "lateral");
  EXPECT_EQ(seen[1].point_ct.x(), 1);
  EXPECT_EQ(seen[2].point_ct.x(), 2);
}

TEST(ClickedPoints, ReplacesAPointWithoutAPixelAndAPixelWithoutAPoint) {
  ClickedPoints clicked;
  clicked.addPoint({1, 0, 0});
  clicked.addPoint({2, 0, 0});
  clicked.addPixel("", {1, 1});
  clicked.addPixel("", {2, 2});  // Waits for the next point,
  clicked.addPixel("", {3, 3});  // as does this one in its place.
  clicked.addPoint({3, 0, 0});
  const std::vector<SeenPoint> seen = clicked.seen();
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].point_ct.x(), 2);
  EXPECT_EQ(seen[0].pixel.x(), 1);
  EXPECT_EQ(seen[1].pixel.x(), 3);
}

TEST(ClickedPoints, TakesBack) {
  ClickedPoints clicked;
  clicked.takeBack();
  clicked.addPoint({1, 0, 0});
  clicked.addPixel("", {1, 1});
  clicked.addPixel("", {2, 2});
  clicked.takeBack();
  EXPECT_EQ(clicked.pairCount(), 1U);
  EXPECT_EQ(clicked.inWords(), "1 landmark");
  clicked.takeBack();
  EXPECT_EQ(clicked.pairCount(), 0U);
  EXPECT_TRUE(clicked.shown().empty());
}

TEST(ClickedPoints, ShowsWhatAgrees) {
  ClickedPoints clicked;
  for (int i = 0; i < 3; ++i) {
    clicked.addPoint({1.0 * i, 0, 0});
    clicked.addPixel("ap", {1.0 * i, 1});
  }
  EXPECT_EQ(clicked.shown().at(0).state, State::kPaired);
  clicked.addPixel("side", {5, 5});
  clicked.addPoint({9, 0, 0});
  clicked.judge({true, false, true, false});
  const std::vector<ShownLandmark> shown = clicked.shown();
  ASSERT_EQ(shown.size(), 4U);
  EXPECT_EQ(shown[0].state, State::kAgrees);
  EXPECT_EQ(shown[1].state, State::kLeftOut);
  EXPECT_EQ(shown[2].state, State::kLeftOut);  // In one of its views.
  EXPECT_EQ(shown[3].state, State::kWaiting);
  clicked.judge({});
  EXPECT_EQ(clicked.shown().at(0).state, State::kPaired);
}

}  // namespace
}  // namespace xray_registration
