// Drivers compile a kernel when it is first launched, PoCL into a folder where it can be seen.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/registration/fast_registrar.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

namespace fs = std::filesystem;

std::set<std::string> compiledIn(const fs::path& folder) {
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".so") files.insert(entry.path().string());
  }
  return files;
}

TEST(WarmUp, NoFrameWaitsForACompiler) {
  std::string pattern = testing::TempDir() + "warm_up_XXXXXX";
  ASSERT_NE(mkdtemp(pattern.data()), nullptr);
  const fs::path folder = pattern;
  ASSERT_EQ(setenv("POCL_CACHE_DIR", pattern.c_str(), 1), 0);  // Before OpenCL is first called in this process.
  FastRegistrar registrar(std::make_shared<Device>(), RegistrarOptions{}, Logger{});
  const AttenuationVolume ct = toAttenuation(headPhantom(4.0), {});
  registrar.setVolume(ct);
  const std::set<std::string> before = compiledIn(folder);
  if (before.empty()) GTEST_SKIP() << "the driver does not compile into POCL_CACHE_DIR";
  XrayFrame view;
  view.camera = {128, 128, 390.0, 390.0, 63.5, 63.5};
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() << 0, 1, 0, 0, 0, -1, -1, 0, 0;
  pose.linear() = rotationFromVector({0.1, 0.3, -0.05}) * pose.linear();
  pose.translation() = Eigen::Vector3d(3.0, -5.0, 780.0) - pose.linear() * registrar.centreCt();
  view.attenuation = referenceProjection(toAttenuation(headPhantom(2.0), {}), pose, view.camera);
  for (const bool tracking : {false, true}) {
    const RegistrationResult result = registrar.registerFrame({view}, pose, tracking);
    EXPECT_TRUE(result.accepted) << result.reason;
  }
  const std::set<std::string> after = compiledIn(folder);
  for (const std::string& file : after) EXPECT_EQ(before.count(file), 1U) << file << " was compiled for a frame";
  fs::remove_all(folder);
}

}  // namespace
}  // namespace xray_registration
