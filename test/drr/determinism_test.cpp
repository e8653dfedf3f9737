#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>
#include <string>

#include "xray_registration/drr/engine.h"
#include "xray_registration/drr/opencl/opencl_device.h"

namespace xray_registration {
namespace {

// A driver's threads are fixed when it is loaded, and a process that has used OpenCL must not fork. So the sums are
// computed by processes of their own, this same binary run with one hidden test, and this process calls no OpenCL.

constexpr const char* kPlatformMark = "platform: ";
constexpr const char* kSumMark = "sum: ";

AttenuationVolume lumps() {
  AttenuationVolume volume;
  volume.grid.size = {52, 47, 44};
  volume.grid.spacing_mm = {1.5, 1.5, 2.0};
  volume.scale_per_mm = 1e-6F;
  for (int z = 0; z < 44; ++z) {
    for (int y = 0; y < 47; ++y) {
      for (int x = 0; x < 52; ++x) {
        const double wave = std::sin(0.41 * x + 0.1 * z) * std::cos(0.33 * y) + std::sin(0.27 * z + 0.2 * y);
        const bool inside = std::hypot(x - 26.0, y - 23.0) < 21.0;
        volume.values.push_back(inside ? static_cast<std::uint16_t>(20000.0 + 6000.0 * wave) : 0);
      }
    }
  }
  return volume;
}

void print(const StepSums& sums) {
  std::printf("%s%a %a %a %a %a\n", kSumMark, sums.cost, sums.weight, sums.similarity, sums.inlier_fraction,
              sums.content);
  for (int row = 0; row < 6; ++row) {
    std::printf("%s%a", kSumMark, sums.gradient[row]);
    for (int column = 0; column < 6; ++column) {
      std::printf(" %a %a", sums.matrix(row, column), sums.scatter(row, column));
    }
    std::printf("\n");
  }
}

TEST(DeterminismTest, DISABLED_PrintSums) {
  const auto device = std::make_shared<Device>();
  std::printf("%s%s\n", kPlatformMark,
              cl::Platform(device->openCl().device.getInfo<CL_DEVICE_PLATFORM>()).getInfo<CL_PLATFORM_NAME>().c_str());
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device);
  engine->setVolume(lumps());
  const XrayCamera camera{140, 132, 700.0, 700.0, 70.0, 66.0};
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector({1.4, 0.2, -0.3});
  pose.translation() = Eigen::Vector3d(1, 2, 500) - pose.linear() * engine->volume().centreCt();
  const Eigen::Vector3d centre = pose * engine->volume().centreCt();
  FloatImage attenuation = engine->render(camera, 0, updatedPose(pose, 0.01 * Twist::Ones(), centre));
  std::mt19937 random(2);
  for (float& pixel : attenuation.pixels) pixel += 1e-11F * static_cast<float>(random());
  FloatImage weight(camera.width, camera.height, 1.0F);
  for (int u = 30; u < 90; ++u) weight.at(u, 61) = 0.0F;
  const std::unique_ptr<ResidentXray> xray = engine->upload(camera, attenuation, weight);
  std::vector<RigidTransform> poses;
  for (int i = 0; i < 7; ++i) poses.push_back(updatedPose(pose, 0.004 * i * Twist::Ones(), centre));
  for (const int span : {0, 1, 2}) {
    for (int level = 0; level <= xray->lastLevel(); ++level) {
      WindowOptions options;
      options.span = span;
      options.robust_scale2 = 0.2;
      for (const StepSums& sums : engine->evaluate(xray.get(), level, 0, poses, options)) print(sums);
    }
  }
}

struct Printed {
  std::string platform;
  std::string sums;
  int status = -1;
};

Printed sumsWith(int threads) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  const std::string command = "POCL_MAX_PTHREAD_COUNT=" + std::to_string(threads) + " '" + self +
                              "' --gtest_also_run_disabled_tests --gtest_filter='*DISABLED_PrintSums'";
  Printed printed;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return printed;
  std::string output;
  std::array<char, 4096> part{};
  while (std::fgets(part.data(), part.size(), pipe) != nullptr) output += part.data();
  printed.status = pclose(pipe);
  for (std::size_t begin = 0; begin < output.size();) {
    const std::size_t end = std::min(output.find('\n', begin), output.size());
    const std::string line = output.substr(begin, end - begin);
    if (line.rfind(kPlatformMark, 0) == 0) printed.platform = line;
    if (line.rfind(kSumMark, 0) == 0) printed.sums += line + "\n";
    begin = end + 1;
  }
  return printed;
}

TEST(DeterminismTest, TheNumberOfThreadsChangesNoBit) {
  const Printed one = sumsWith(1);
  ASSERT_EQ(one.status, 0);
  ASSERT_FALSE(one.sums.empty());
  EXPECT_EQ(one.sums.find("nan"), std::string::npos);
  if (one.platform.find("Portable Computing Language") == std::string::npos) {
    GTEST_SKIP() << "only PoCL's number of threads can be set; " << one.platform;
  }
  const Printed two = sumsWith(2);
  ASSERT_EQ(two.status, 0);
  EXPECT_EQ(one.sums, two.sums);
  const Printed all = sumsWith(64);  // As many as there are.
  ASSERT_EQ(all.status, 0);
  EXPECT_EQ(one.sums, all.sums);
}

}  // namespace
}  // namespace xray_registration
