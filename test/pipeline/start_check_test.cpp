#include "xray_registration/pipeline/start_check.h"

#include <gtest/gtest.h>

#include <cmath>

namespace xray_registration {
namespace {

/// 240 mm of a CT whose origin is in its middle, in a detector of 320 mm at 1 m.
VolumeGrid head() {
  VolumeGrid grid;
  grid.size = {120, 120, 120};
  grid.spacing_mm = {2.0, 2.0, 2.0};
  grid.origin_ct_mm = {-119.0, -119.0, -119.0};
  return grid;
}
const XrayCamera kCamera{128, 128, 400.0, 400.0, 63.5, 63.5};

RigidTransform at(double x, double y, double z) {
  RigidTransform T = RigidTransform::Identity();
  T.translation() = Eigen::Vector3d(x, y, z);
  return T;
}

std::string problem(double x, double y, double z) { return impossibleStart(at(x, y, z), head(), kCamera); }

void expectWords(const std::string& text, const std::vector<const char*>& words) {
  for (const char* word : words) EXPECT_NE(text.find(word), std::string::npos) << text;
}

TEST(StartCheck, LeavesWhatASearchMayArriveFrom) {
  for (const double x : {-150.0, 0.0, 150.0}) {
    for (const double z : {300.0, 750.0, 2000.0}) EXPECT_EQ(problem(x, 30.0, z), "") << x << " " << z;
  }
  EXPECT_EQ(problem(0.0, 0.0, 60.0), "");  // The source inside the CT's air.
}

TEST(StartCheck, NamesMillimetresForMetres) {
  expectWords(problem(0.0, 40e3, 750e3), {"the start is wrong", "750 m", "speck", "millimetres where metres are due"});
}

TEST(StartCheck, NamesMetresForMillimetres) {
  expectWords(problem(0.0, 0.04, 0.75), {"around the X-ray source", "metres where millimetres are due"});
}

TEST(StartCheck, NamesWhatIsBehindAndBeside) {
  expectWords(problem(0.0, 0.0, -750.0), {"behind the X-ray source", "-0.75 m", "optical frame"});
  expectWords(problem(750.0, 0.0, 400.0), {"beside the image", "column 814", "128 x 128"});
  expectWords(problem(0.0, -750.0, 400.0), {"beside the image", "row -686"});
}

}  // namespace
}  // namespace xray_registration
