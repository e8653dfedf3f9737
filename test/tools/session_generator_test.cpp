#include "tools/common/session_generator.h"

#include <gtest/gtest.h>

#include "tools/common/command_line.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration::tools {
namespace {

SessionSetup smallSetup() {
  SessionSetup setup;
  setup.views = {{"ap", 0.0}, {"lateral", 90.0}};
  setup.image_size = 32;
  return setup;
}

TEST(Trajectory, StaysWithinItsAmplitudesAndRepeats) {
  const Trajectory trajectory(10.0, 6.0, 4.0, 7);
  const Eigen::Vector3d centre(10.0, 20.0, 30.0);
  double largest_mm = 0.0;
  for (int i = 0; i < 200; ++i) {
    const RigidTransform motion = trajectory.motionCt(0.02 * i, centre);
    const Twist twist = twistBetween(RigidTransform::Identity(), motion, centre);
    EXPECT_LE(twist.head<3>().cwiseAbs().maxCoeff(), 10.0 + 1e-9);
    EXPECT_LE(twist.tail<3>().cwiseAbs().maxCoeff(), 6.0 * M_PI / 180.0 + 1e-9);
    largest_mm = std::max(largest_mm, twist.head<3>().norm());
  }
  EXPECT_GT(largest_mm, 5.0);  // The first sine alone reaches 6 mm.
  EXPECT_TRUE(trajectory.motionCt(0.5, centre).isApprox(trajectory.motionCt(4.5, centre), 1e-9));
  EXPECT_FALSE(trajectory.motionCt(0.5, centre).isApprox(Trajectory(10.0, 6.0, 4.0, 8).motionCt(0.5, centre), 1e-3));
}

TEST(SessionGenerator, SameSetupSameImages) {
  const Volume ct = whiteCube(24);
  const SessionGenerator first(ct, smallSetup());
  const SessionGenerator second(ct, smallSetup());
  EXPECT_EQ(first.xray(1, 3, 0.3).pixels, second.xray(1, 3, 0.3).pixels);
  EXPECT_NE(first.xray(1, 3, 0.3).pixels, first.xray(1, 4, 0.3).pixels);  // Another frame, other noise.
}

TEST(SessionGenerator, ViewsSeeOneMotion) {
  const SessionGenerator generator(whiteCube(24), smallSetup());
  for (const double time_s : {0.0, 0.7, 2.1}) {
    EXPECT_TRUE((generator.viewFromFirst(1) * generator.cameraFromCt(0, time_s))
                    .isApprox(generator.cameraFromCt(1, time_s), 1e-9));
  }
}

TEST(SessionGenerator, CamerasLookAtTheCentreFromTheirSides) {
  SessionSetup setup = smallSetup();
  setup.amplitude_mm = 0.0;
  setup.amplitude_deg = 0.0;
  const SessionGenerator generator(whiteCube(24), setup);
  for (std::size_t view = 0; view < 2; ++view) {
    const Eigen::Vector3d centre_camera = generator.cameraFromCt(view, 0.0) * generator.centreCt();
    EXPECT_TRUE(centre_camera.isApprox(Eigen::Vector3d(0.0, 0.0, setup.source_centre_mm), 1e-9));
  }
  // LPS: the first beam runs from front to back (+y), the second from the patient's left to the right (-x).
  EXPECT_TRUE(generator.cameraFromCt(0, 0.0).linear().row(2).transpose().isApprox(Eigen::Vector3d::UnitY(), 1e-9));
  EXPECT_TRUE(generator.cameraFromCt(1, 0.0).linear().row(2).transpose().isApprox(-Eigen::Vector3d::UnitX(), 1e-9));
  EXPECT_TRUE(isRigid(generator.cameraFromCt(1, 0.0).matrix(), 1e-9));
}

TEST(SessionGenerator, InstrumentDarkensPixels) {
  SessionSetup setup = smallSetup();
  setup.image_size = 64;  // The rod covers some pixels.
  setup.physics.photons_per_pixel = 0.0;
  setup.physics.readout_noise = 0.0;
  setup.physics.scatter_fraction = 0.0;
  const Volume ct = whiteCube(24);
  const auto without = SessionGenerator(ct, setup).xray(0, 0, 0.0);
  setup.instrument = true;
  const auto with = SessionGenerator(ct, setup).xray(0, 0, 0.0);
  int darker = 0;
  for (std::size_t i = 0; i < with.pixels.size(); ++i) {
    EXPECT_LE(with.pixels[i], without.pixels[i]);
    darker += 2 * with.pixels[i] < without.pixels[i] ? 1 : 0;
  }
  EXPECT_GT(darker, 20);
  EXPECT_LT(darker, 1000);
}

TEST(SessionSetup, RefusesWhatIsOutOfRange) {
  SessionSetup setup = smallSetup();
  setup.source_centre_mm = 1300.0;  // Behind the detector.
  EXPECT_THROW(setup.check(), ArgumentError);
  setup = smallSetup();
  setup.image_size = 4;
  EXPECT_THROW(setup.check(), ArgumentError);
  setup = smallSetup();
  setup.physics.gain = std::nan("");
  EXPECT_THROW(setup.check(), ArgumentError);
}

TEST(ParseViews, NamesAndAngles) {
  const auto views = parseViews("ap:0,oblique:-50.5");
  ASSERT_EQ(views.size(), 2U);
  EXPECT_EQ(views[1].name, "oblique");
  EXPECT_DOUBLE_EQ(views[1].angle_deg, -50.5);
  for (const char* wrong : {"", "ap", ":5", "ap:x", "ap:", "ap:0,ap:1"}) {
    EXPECT_THROW(parseViews(wrong), ArgumentError) << wrong;
  }
}

}  // namespace
}  // namespace xray_registration::tools
