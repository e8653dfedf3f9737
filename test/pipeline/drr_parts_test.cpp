#include "xray_registration/pipeline/drr_parts.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

BodyParameters configured(const std::string& name) {
  BodyParameters body;
  body.name = name;
  return body;
}

BodyResult found(const std::string& name, bool accepted) {
  BodyResult body;
  body.name = name;
  body.solved = true;
  body.accepted = accepted;
  return body;
}

/// A CT and three bodies, of which the second is refused and the third has no pose.
struct Example {
  Example() {
    result.accepted = true;
    result.bodies = {found("T12", true), found("T11", false), found("T10", false)};
    parts.ct = FloatImage(4, 3, 1.0F);
    parts.bodies = {FloatImage(4, 3, 2.0F), FloatImage(4, 3, 4.0F), FloatImage()};
  }
  RegistrationResult result;
  DrrParts parts;
  std::vector<BodyParameters> bodies = {configured("T10"), configured("T11"), configured("T12")};
};

TEST(DrrParts, TheDrrIsTheSumOfWhatWasAccepted) {
  Example example;
  EXPECT_EQ(acceptedDrr(example.parts, example.result).pixels, FloatImage(4, 3, 3.0F).pixels);
  example.result.accepted = false;
  EXPECT_EQ(acceptedDrr(example.parts, example.result).pixels, FloatImage(4, 3, 2.0F).pixels);
  example.result.bodies[0].accepted = false;
  EXPECT_TRUE(acceptedDrr(example.parts, example.result).empty());
}

TEST(DrrParts, EachBodyHasTheColourOfItsPlaceInTheConfiguration) {
  const Example example;
  const std::vector<OverlayLine> lines = overlayLines(example.parts, example.result, example.bodies);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].colour, kAcceptedColour);
  EXPECT_EQ(lines[1].colour, bodyColour(2));
  EXPECT_FALSE(lines[1].dashed);
  EXPECT_EQ(lines[1].drr, &example.parts.bodies[0]);
}

TEST(DrrParts, WhatWasRefusedIsRedAndABodyDashed) {
  Example example;
  std::vector<OverlayLine> lines = overlayLines(example.parts, example.result, example.bodies);
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[2].colour, kRefusedColour);
  EXPECT_TRUE(lines[2].dashed);
  example.result.accepted = false;
  lines = overlayLines(example.parts, example.result, example.bodies);
  EXPECT_EQ(lines[0].colour, kRefusedColour);
  EXPECT_FALSE(lines[0].dashed);
}

TEST(DrrParts, ColoursOfBodiesAreNeitherTheCtsNorRed) {
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NE(bodyColour(i), kAcceptedColour);
    EXPECT_NE(bodyColour(i), kRefusedColour);
    for (std::size_t j = 0; j < i; ++j) EXPECT_NE(bodyColour(i), bodyColour(j));
  }
}

TEST(DrrParts, ALargeViewIsShownSmaller) {
  XrayFrame frame;
  frame.camera.width = 2000;
  frame.camera.height = 1500;
  frame.camera.fx = frame.camera.fy = 3000.0;
  frame.camera.cx = 999.5;
  frame.camera.cy = 749.5;
  frame.attenuation = FloatImage(2000, 1500, 2.0F);
  ViewInput view(frame);
  view.T_view_first.translation() << 1.0, 2.0, 3.0;
  view.name = "ap";
  const ViewInput shown = forDisplay(view);
  EXPECT_EQ(shown.xray->attenuation.width(), 666);  // Three pixels to one.
  EXPECT_EQ(shown.xray->attenuation.height(), 500);
  EXPECT_EQ(shown.xray->camera.width, 666);
  EXPECT_EQ(shown.xray->attenuation.at(333, 250), 2.0F);
  EXPECT_EQ(shown.name, "ap");
  EXPECT_EQ(shown.T_view_first.translation(), view.T_view_first.translation());
  // What is small already is the same picture.
  const ViewInput small(XrayFrame{shown.xray->camera, shown.xray->attenuation, shown.xray->mask});
  EXPECT_EQ(forDisplay(small).xray, small.xray);
}

}  // namespace
}  // namespace xray_registration
