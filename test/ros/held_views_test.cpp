#include "ros/held_views.h"

#include <gtest/gtest.h>

#include <boost/make_shared.hpp>

namespace xray_registration {
namespace {

ViewMessage view(const std::optional<double>& held_for_s) {
  return {boost::make_shared<sensor_msgs::Image>(), nullptr, "", held_for_s};
}

FrameMessages frame(std::vector<ViewMessage> views) {
  FrameMessages messages;
  messages.views = std::move(views);
  return messages;
}

const std::vector<std::string> kNames = {"ap", "lateral"};

TEST(HeldViews, NewImagesAreNoProblem) {
  const FrameMessages good = frame({view({}), view({})});
  EXPECT_EQ(heldProblem(good, kNames, false), "");
  EXPECT_EQ(longestHeld(good), 0.0);
}

TEST(HeldViews, OneThatIsHeldSpoilsTheFrameUnlessItMayBeMissing) {
  const FrameMessages half = frame({view({}), view(1.5)});
  EXPECT_EQ(heldProblem(half, kNames, false),
            "view 'lateral': the image is held: its pixels are those of the image 1.5 s before");
  EXPECT_EQ(heldProblem(half, kNames, true), "");
  EXPECT_EQ(longestHeld(half), 1.5);
}

TEST(HeldViews, AllThatAreHeldAreNamed) {
  const std::string problem = heldProblem(frame({view(0.5), view(1.5)}), kNames, true);
  EXPECT_NE(problem.find("view 'ap': "), std::string::npos) << problem;
  EXPECT_NE(problem.find("; view 'lateral': "), std::string::npos) << problem;
  EXPECT_EQ(heldProblem(frame({view(0.5)}), {""}, false).find("view"), std::string::npos);
}

}  // namespace
}  // namespace xray_registration
