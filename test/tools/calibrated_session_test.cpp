#include "tools/calibrate/session/calibrated_session.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace xray_registration::tools {
namespace {

std::vector<CalibratedSessionView> twoViews(const std::string& frame_id) {
  std::vector<CalibratedSessionView> views(2);
  views[0].bag = {"carm/ap", "ap_optical", RigidTransform::Identity()};
  views[1].bag = {"lateral", frame_id, RigidTransform::Identity()};
  for (CalibratedSessionView& view : views) {
    view.told.width = 100;
    view.told.height = 80;
    view.told.k = {500.0, 0.0, 49.5, 0.0, 500.0, 39.5, 0.0, 0.0, 1.0};
    view.T_view_first = RigidTransform::Identity();
  }
  return views;
}

class CalibratedSession : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string folder_ = testing::TempDir() + "calibrated_session_test";
};

TEST_F(CalibratedSession, FilesLieInTheFolder) {
  const std::vector<std::string> expected = {folder_ + "/carm_ap.yaml", folder_ + "/lateral.yaml",
                                             folder_ + "/views.launch"};
  EXPECT_EQ(writeFiles(folder_, twoViews("lateral_optical")), expected);
  std::ifstream stream(expected[2]);
  const std::string launch((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  EXPECT_NE(launch.find("ap_optical lateral_optical\"/>"), std::string::npos) << launch;
}

// roslaunch would run what a bag's frame_id says.
TEST_F(CalibratedSession, AFrameThatIsMoreThanANameIsRefused) {
  for (const char* frame : {"x\"/><node pkg=\"evil\" type=\"evil\" name=\"e", "$(eval 1)", "x --evil", "x\n", ""}) {
    EXPECT_THROW(writeFiles(folder_, twoViews(frame)), std::runtime_error) << frame;
    EXPECT_FALSE(std::filesystem::exists(folder_ + "/views.launch")) << frame;
  }
}

}  // namespace
}  // namespace xray_registration::tools
