#include "registration/body_judgement.h"

#include <gtest/gtest.h>

namespace xray_registration {
namespace {

std::vector<BodyResult> acceptedBodies() {
  std::vector<BodyResult> bodies(3);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    bodies[i].name = "L" + std::to_string(i + 1);
    bodies[i].accepted = true;
  }
  return bodies;
}

TEST(RefuseOverlaps, BothBodiesInOnePlaceAreRefusedAndNoOther) {
  std::vector<BodyResult> bodies = acceptedBodies();
  Eigen::MatrixXd overlaps = Eigen::MatrixXd::Zero(3, 3);
  overlaps(0, 1) = overlaps(1, 0) = 900.0;
  overlaps(1, 2) = overlaps(2, 1) = 100.0;
  refuseOverlaps(overlaps, {}, &bodies);
  EXPECT_FALSE(bodies[0].accepted);
  EXPECT_FALSE(bodies[1].accepted);
  EXPECT_TRUE(bodies[2].accepted);
  EXPECT_NE(bodies[0].reason.find("L1 and L2 lie in one place: 900 mm³"), std::string::npos) << bodies[0].reason;
  EXPECT_NE(bodies[1].reason.find("L2 and L1"), std::string::npos) << bodies[1].reason;
  EXPECT_TRUE(bodies[2].reason.empty());
}

TEST(RefuseOverlaps, ARefusedBodySaysNothingAboutWhereBoneIs) {
  std::vector<BodyResult> bodies = acceptedBodies();
  bodies[0].accepted = false;
  bodies[0].reason = "L1 left the image";
  Eigen::MatrixXd overlaps = Eigen::MatrixXd::Zero(3, 3);
  overlaps(0, 1) = overlaps(1, 0) = 900.0;
  refuseOverlaps(overlaps, {}, &bodies);
  EXPECT_TRUE(bodies[1].accepted);
  EXPECT_EQ(bodies[0].reason, "L1 left the image");
}

}  // namespace
}  // namespace xray_registration
