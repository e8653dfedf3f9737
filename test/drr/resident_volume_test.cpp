#include "xray_registration/drr/resident_volume.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

namespace xray_registration {
namespace {

/// A device whose memory is no bound.
VolumeLimits indexLimitsAlone() {
  VolumeLimits limits;
  limits.buffer_bytes = std::size_t{1} << 40U;
  limits.memory_bytes = std::size_t{1} << 42U;
  return limits;
}

std::string refusalOf(const Eigen::Vector3i& padded, const VolumeLimits& limits) {
  try {
    checkFits(padded, limits, "a device");
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

TEST(VolumeLimitsTest, IndicesOf32BitsBoundTheBudgetOfALargeDevice) {
  const std::size_t budget = residentVoxelBytes(indexLimitsAlone());
  const std::size_t voxels = budget / sizeof(std::uint16_t);
  // A cube of that many voxels, with two layers of air on every side.
  const auto side = static_cast<std::size_t>(std::cbrt(static_cast<double>(voxels))) + 4;
  EXPECT_LE(side * side * side, 0x7fffffffU);
  EXPECT_GT(voxels, 0x7fffffffU / 10 * 8) << "no more is given away than the padding needs";
  VolumeLimits small = indexLimitsAlone();
  small.buffer_bytes = 1000000;
  EXPECT_EQ(residentVoxelBytes(small), 450000U) << "a small device is bound by its memory";
}

TEST(VolumeLimitsTest, ALevelBeyondTheIndicesIsRefusedWithBothSizes) {
  EXPECT_EQ(refusalOf({1290, 1290, 1290}, indexLimitsAlone()), "");
  const std::string refusal = refusalOf({1300, 1300, 1300}, indexLimitsAlone());
  EXPECT_NE(refusal.find("2197000000"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("2147483647"), std::string::npos) << refusal;
}

TEST(VolumeLimitsTest, ALevelBeyondOneBufferIsRefusedWithBothSizes) {
  VolumeLimits limits = indexLimitsAlone();
  limits.buffer_bytes = std::size_t{30} << 20U;
  EXPECT_EQ(refusalOf({190, 200, 200}, limits), "");
  const std::string refusal = refusalOf({256, 256, 256}, limits);
  EXPECT_NE(refusal.find("64 MiB"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("30 MiB"), std::string::npos) << refusal;
}

}  // namespace
}  // namespace xray_registration
