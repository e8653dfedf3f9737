#include "xray_registration/ros/result_transforms.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace xray_registration {
namespace {

RigidTransform at(double z_mm) {
  RigidTransform T = RigidTransform::Identity();
  T.translation().z() = z_mm;
  return T;
}

BodyParameters configured(const std::string& name, const std::string& frame) {
  BodyParameters body;
  body.name = name;
  body.frame = frame;
  return body;
}

BodyResult found(const std::string& name, bool accepted, double z_mm) {
  BodyResult body;
  body.name = name;
  body.solved = true;
  body.accepted = accepted;
  body.T_camera_body = at(z_mm);
  return body;
}

const std::vector<BodyParameters> kBodies = {configured("T11", "t11_link"), configured("T12", "T12")};

/// The CT and T11 are accepted, T12 is not.
RegistrationResult result() {
  RegistrationResult result;
  result.accepted = true;
  result.T_camera_ct = at(800.0);
  result.bodies = {found("T11", true, 810.0), found("T12", false, 820.0)};
  return result;
}

std_msgs::Header header() {
  std_msgs::Header header;
  header.frame_id = "xray_optical";
  header.stamp.fromSec(5.5);
  return header;
}

/// tf is a tree: a frame has one parent.
bool isTree(const std::vector<geometry_msgs::TransformStamped>& transforms) {
  std::set<std::string> children;
  return std::all_of(transforms.begin(), transforms.end(),
                     [&](const auto& transform) { return children.insert(transform.child_frame_id).second; });
}

TEST(ResultTransforms, HoldTheCtAndTheAcceptedBodies) {
  const auto transforms = resultTransforms(header(), result(), RigidTransform::Identity(), {}, kBodies);
  ASSERT_EQ(transforms.size(), 2U);
  EXPECT_EQ(transforms[0].header.frame_id, "xray_optical");
  EXPECT_EQ(transforms[0].child_frame_id, "ct");
  EXPECT_DOUBLE_EQ(transforms[0].transform.translation.z, 0.8);
  EXPECT_EQ(transforms[1].header.frame_id, "xray_optical");
  EXPECT_EQ(transforms[1].child_frame_id, "t11_link");
  EXPECT_EQ(transforms[1].header.stamp, header().stamp);
  EXPECT_DOUBLE_EQ(transforms[1].transform.translation.z, 0.81);
}

TEST(ResultTransforms, GoFromTheFixedFrameWhenThereIsOne) {
  FrameParameters frames;
  frames.fixed = "room";
  const auto transforms = resultTransforms(header(), result(), at(1000.0), frames, kBodies);
  ASSERT_EQ(transforms.size(), 2U);
  EXPECT_EQ(transforms[1].header.frame_id, "room");
  EXPECT_DOUBLE_EQ(transforms[1].transform.translation.z, 1.81);
}

TEST(ResultTransforms, AreATreeAlsoWhenTheCtIsTheParent) {
  FrameParameters frames;
  frames.invert_tf = true;
  RegistrationResult both = result();
  both.bodies[1].accepted = true;
  const auto transforms = resultTransforms(header(), both, RigidTransform::Identity(), frames, kBodies);
  ASSERT_EQ(transforms.size(), 3U);
  EXPECT_EQ(transforms[0].header.frame_id, "ct");
  EXPECT_EQ(transforms[0].child_frame_id, "xray_optical");
  EXPECT_DOUBLE_EQ(transforms[0].transform.translation.z, -0.8);
  EXPECT_EQ(transforms[2].header.frame_id, "xray_optical");
  EXPECT_EQ(transforms[2].child_frame_id, "T12");
  EXPECT_TRUE(isTree(transforms));
}

TEST(ResultTransforms, ABodyMayBeAcceptedWithoutTheCt) {
  RegistrationResult refused = result();
  refused.accepted = false;
  const auto transforms = resultTransforms(header(), refused, RigidTransform::Identity(), {}, kBodies);
  ASSERT_EQ(transforms.size(), 1U);
  EXPECT_EQ(transforms[0].child_frame_id, "t11_link");
  refused.bodies.clear();
  EXPECT_TRUE(resultTransforms(header(), refused, RigidTransform::Identity(), {}, kBodies).empty());
}

TEST(ResultTransforms, ImagesInAFrameThatIsFoundAreNamed) {
  EXPECT_EQ(frameProblem("xray_optical", {}, kBodies), "");
  EXPECT_NE(frameProblem("ct", {}, kBodies).find("frames/ct"), std::string::npos);
  EXPECT_NE(frameProblem("t11_link", {}, kBodies).find("'T11'"), std::string::npos);
  EXPECT_EQ(frameProblem("T11", {}, kBodies), "");
  EXPECT_NE(frameProblem("", {}, kBodies), "");
}

TEST(FrameChange, GivesTwoParents) {
  FrameParameters frames;
  EXPECT_EQ(frameChangeProblem("ap", "", frames), "");
  EXPECT_EQ(frameChangeProblem("ap", "ap", frames), "");
  const std::string problem = frameChangeProblem("lateral", "ap", frames);
  for (const char* word : {"'lateral'", "'ap'", "two parents", "~reset", "frames/allow_change"}) {
    EXPECT_NE(problem.find(word), std::string::npos) << problem;
  }
  frames.allow_change = true;
  EXPECT_EQ(frameChangeProblem("lateral", "ap", frames), "");
}

TEST(StartFrame, IsNoneThatIsPlaced) {
  EXPECT_EQ(startFrameProblem("xray_optical", {}, kBodies), "");
  EXPECT_NE(startFrameProblem("ct", {}, kBodies).find("frames/ct"), std::string::npos);
  EXPECT_NE(startFrameProblem("t11_link", {}, kBodies).find("'T11'"), std::string::npos);
}

}  // namespace
}  // namespace xray_registration
