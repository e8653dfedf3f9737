#include "drr/opencl/opencl_xray.h"

#include <gtest/gtest.h>

#include <vector>

namespace xray_registration {
namespace {

class OpenClXrayTest : public testing::Test {
 protected:
  std::vector<float> read(const cl::Buffer& buffer, int pixels) {
    std::vector<float> values(static_cast<std::size_t>(pixels));
    bench_.queue().enqueueReadBuffer(buffer, CL_TRUE, 0, sizeof(float) * values.size(), values.data());
    return values;
  }
  std::unique_ptr<OpenClXray> upload(const FloatImage& image, const FloatImage& weight) {
    const XrayCamera camera{image.width, image.height, 100.0, 100.0, 31.5, 31.5};
    return std::make_unique<OpenClXray>(camera, image, weight, spares_, &bench_);
  }

  Workbench bench_{std::make_shared<Device>()};
  std::shared_ptr<SpareStorage> spares_ = std::make_shared<SpareStorage>();
};

TEST_F(OpenClXrayTest, LevelsAreWeightedMeans) {
  FloatImage image(64, 64);
  FloatImage weight(64, 64, 1.0F);
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 64; ++u) image.at(u, v) = static_cast<float>(u + 100 * v);
  }
  weight.at(20, 30) = 0.0F;                                // One of four.
  for (int u = 40; u < 42; ++u) weight.at(u, 30) = 0.25F;  // Less than half of four.
  weight.at(40, 31) = weight.at(41, 31) = 0.5F;
  const auto xray = upload(image, weight);
  ASSERT_EQ(xray->lastLevel(), 1);
  EXPECT_EQ(xray->level(1).camera.width, 32);
  EXPECT_EQ(xray->level(1).tiles(), 16);
  xray->makeReady(1, &bench_);
  const std::vector<float> half = read(xray->attenuation(1), 32 * 32);
  const std::vector<float> half_weight = read(xray->weight(1), 32 * 32);
  EXPECT_FLOAT_EQ(half[3 + 32 * 5], 6.5F + 100.0F * 10.5F);
  EXPECT_FLOAT_EQ(half_weight[3 + 32 * 5], 1.0F);
  EXPECT_FLOAT_EQ(half[10 + 32 * 15], (21.0F + 20.0F + 21.0F + 100.0F * (30.0F + 31.0F + 31.0F)) / 3.0F);
  EXPECT_FLOAT_EQ(half_weight[10 + 32 * 15], 0.75F);
  EXPECT_FLOAT_EQ(half_weight[20 + 32 * 15], 0.0F);
}

TEST_F(OpenClXrayTest, NothingIsMadeBeforeItIsAskedFor) {
  const FloatImage image(128, 128, 1.0F);
  const auto xray = upload(image, image);
  ASSERT_EQ(xray->lastLevel(), 2);
  EXPECT_EQ(bench_.work().launches, 0U);
  xray->makeReady(1, &bench_);
  EXPECT_EQ(bench_.work().halvings, 1U);
  xray->restoreWeights();
  xray->makeReady(1, &bench_);
  EXPECT_EQ(bench_.work().halvings, 1U) << "nothing had changed";
  xray->makeReady(2, &bench_);
  EXPECT_EQ(bench_.work().halvings, 2U);
}

TEST_F(OpenClXrayTest, StorageGoesOn) {
  const FloatImage large(128, 128, 1.0F);
  const FloatImage small(120, 96, 1.0F);
  upload(large, large)->makeReady(2, &bench_);
  const std::size_t buffers = bench_.work().buffers;
  upload(small, small)->makeReady(1, &bench_);
  upload(large, large)->makeReady(2, &bench_);
  EXPECT_EQ(bench_.work().buffers, buffers);
  const auto first = upload(large, large);
  const auto second = upload(large, large);  // While the first is still there.
  first->makeReady(0, &bench_);
  second->makeReady(0, &bench_);
  EXPECT_GT(bench_.work().buffers, buffers);
  EXPECT_NE(first->attenuation(0)(), second->attenuation(0)());
}

}  // namespace
}  // namespace xray_registration
