#include "tools/common/session_bodies.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tools/common/command_line.h"
#include "tools/common/session_generator.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration::tools {
namespace {

const LabelledPhantom& pelvis() {
  static const LabelledPhantom phantom = labelledPelvisPhantom(4.0);
  return phantom;
}

SessionBodies twoBodies() {
  SessionBodies bodies;
  bodies.bodies = {{"femur", {pelvis().names.at("femur_right")}}, {"L4", {pelvis().names.at("L4")}}};
  bodies.rotation_deg = 2.0;
  bodies.translation_mm = 3.0;
  return bodies;
}

MovingBodies moving(const SessionBodies& setup, std::uint64_t seed = 1) {
  return MovingBodies(pelvis().ct, {}, pelvis().labels, setup, 4.0, seed);
}

// What a body's motion is about its own centre.
Twist motionOf(const MovingBodies& bodies, std::size_t body, double time_s) {
  return twistBetween(RigidTransform::Identity(), bodies.motionCt(body, time_s), bodies.centreCt(body));
}

TEST(SessionBodies, MoveWithinTheirBoundsEachInItsOwnWay) {
  const MovingBodies bodies = moving(twoBodies());
  double largest_mm = 0.0;
  double largest_rad = 0.0;
  for (int i = 0; i < 100; ++i) {
    for (const std::size_t body : {0U, 1U}) {
      const Twist motion = motionOf(bodies, body, 0.04 * i);
      EXPECT_LE(motion.head<3>().norm(), 3.0 + 1e-9);
      EXPECT_LE(motion.tail<3>().norm(), 2.0 * M_PI / 180.0 + 1e-9);
      largest_mm = std::max(largest_mm, motion.head<3>().norm());
      largest_rad = std::max(largest_rad, motion.tail<3>().norm());
    }
  }
  // Three sines along each axis seldom meet in one corner.
  EXPECT_GT(largest_mm, 1.0);
  EXPECT_GT(largest_rad, 0.6 * M_PI / 180.0);
  EXPECT_GT((motionOf(bodies, 0, 1.0) - motionOf(bodies, 1, 1.0)).norm(), 0.1);
  EXPECT_TRUE(bodies.motionCt(0, 0.3).isApprox(bodies.motionCt(0, 4.3), 1e-9));
  EXPECT_TRUE(bodies.motionCt(0, 0.3).isApprox(moving(twoBodies()).motionCt(0, 0.3), 1e-12));
  EXPECT_FALSE(bodies.motionCt(0, 0.3).isApprox(moving(twoBodies(), 2).motionCt(0, 0.3), 1e-4));
}

TEST(SessionBodies, AJointSwingsAboutItsPivotAndBack) {
  SessionBodies setup = twoBodies();
  setup.rotation_deg = 0.0;
  setup.translation_mm = 0.0;
  setup.joint = SessionJoint{"femur", 30.0, pelvis().joints_ct_mm.at("femur_right")};
  const MovingBodies bodies = moving(setup);
  const Eigen::Vector3d pivot = *setup.joint->pivot_ct_mm;
  EXPECT_TRUE(bodies.motionCt(0, 0.0).isApprox(RigidTransform::Identity(), 1e-9));
  double before = -1.0;
  for (int i = 0; i <= 10; ++i) {
    const RigidTransform motion = bodies.motionCt(0, 0.2 * i);
    EXPECT_TRUE((motion * pivot).isApprox(pivot, 1e-9));
    const double angle = rotationAngleBetween(motion, RigidTransform::Identity());
    EXPECT_GT(angle, before);
    before = angle;
  }
  EXPECT_NEAR(before, 30.0 * M_PI / 180.0, 1e-9);
  EXPECT_TRUE(bodies.motionCt(0, 4.0).isApprox(RigidTransform::Identity(), 1e-9));
  EXPECT_TRUE(bodies.motionCt(1, 2.0).isApprox(RigidTransform::Identity(), 1e-9));
}

TEST(SessionBodies, TheXrayShowsThemWhereTheTruthSaysThatTheyAre) {
  SessionSetup setup;
  setup.image_size = 48;
  setup.physics.photons_per_pixel = 0.0;
  setup.physics.readout_noise = 0.0;
  setup.bodies = twoBodies();
  setup.bodies.rotation_deg = 8.0;
  setup.bodies.translation_mm = 10.0;
  const SessionGenerator generator(pelvis().ct, setup, pelvis().labels);
  const double time_s = 1.3;
  const CutCt parts = cutBodies(pelvis().ct, setup.attenuation, pelvis().labels,
                                {setup.bodies.bodies[0].labels, setup.bodies.bodies[1].labels});
  std::vector<PosedVolume> placed = {{&parts.rest, generator.cameraFromCt(0, time_s)}};
  for (std::size_t i = 0; i < 2; ++i) placed.push_back({&parts.bodies[i], generator.cameraFromBody(0, i, time_s)});
  std::mt19937_64 random(1);
  const auto expected = simulateXray(placed, generator.camera(), setup.physics, &random);
  EXPECT_EQ(generator.xray(0, 0, time_s).pixels, expected.pixels);
  SessionSetup still = setup;
  still.bodies = {};
  EXPECT_NE(SessionGenerator(pelvis().ct, still).xray(0, 0, time_s).pixels, expected.pixels);
}

TEST(SessionBodies, ThatDoNotMoveLeaveTheImageAsItIs) {
  SessionSetup setup;
  setup.image_size = 32;
  setup.physics.photons_per_pixel = 0.0;
  setup.physics.readout_noise = 0.0;
  const auto whole = SessionGenerator(pelvis().ct, setup).xray(0, 0, 0.7);
  setup.bodies = twoBodies();
  setup.bodies.rotation_deg = 0.0;
  setup.bodies.translation_mm = 0.0;
  const auto cut = SessionGenerator(pelvis().ct, setup, pelvis().labels).xray(0, 0, 0.7);
  for (std::size_t i = 0; i < whole.pixels.size(); ++i) ASSERT_NEAR(cut.pixels[i], whole.pixels[i], 1);
}

TEST(SessionBodies, AreNamedInWords) {
  const auto bodies = parseBodies("T12:32,T11:33,T12:103");
  ASSERT_EQ(bodies.size(), 2U);
  EXPECT_EQ(bodies[0].labels, (std::vector<int>{32, 103}));
  EXPECT_TRUE(parseBodies("").empty());
  for (const char* wrong : {"T12", "T12:", ":3", "T12:0", "T12:1.5", "T12:70000", "a b:3", "T12:3:4"}) {
    EXPECT_THROW(parseBodies(wrong), ArgumentError) << wrong;
  }
  const SessionJoint joint = parseJoint("femur:30:-98,27,-332.5");
  EXPECT_EQ(joint.body, "femur");
  EXPECT_EQ(joint.angle_deg, 30.0);
  EXPECT_TRUE(joint.pivot_ct_mm->isApprox(Eigen::Vector3d(-98.0, 27.0, -332.5)));
  EXPECT_FALSE(parseJoint("femur:-20").pivot_ct_mm);
  for (const char* wrong : {"femur", "femur:x", "femur:30:1,2", "femur:30:1,2,3:4", ""}) {
    EXPECT_THROW(parseJoint(wrong), ArgumentError) << wrong;
  }
}

TEST(SessionBodies, RefuseWhatIsOutOfRange) {
  SessionBodies bodies = twoBodies();
  bodies.rotation_deg = 91.0;
  EXPECT_THROW(bodies.check(), ArgumentError);
  bodies = twoBodies();
  bodies.translation_mm = -1.0;
  EXPECT_THROW(bodies.check(), ArgumentError);
  bodies = twoBodies();
  bodies.joint = SessionJoint{"tibia", 30.0, {}};
  EXPECT_THROW(bodies.check(), ArgumentError);
}

}  // namespace
}  // namespace xray_registration::tools
