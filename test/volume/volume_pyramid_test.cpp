#include "xray_registration/volume/volume_pyramid.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

namespace xray_registration {
namespace {

AttenuationVolume randomVolume(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm) {
  AttenuationVolume volume;
  volume.grid.size = size;
  volume.grid.spacing_mm = spacing_mm;
  volume.grid.origin_ct_mm = {-7.0, 11.0, 42.0};
  volume.grid.direction = Eigen::AngleAxisd(0.5, Eigen::Vector3d(0.2, 1.0, -0.4).normalized()).toRotationMatrix();
  volume.scale_per_mm = 1e-6F;
  volume.values.resize(volume.grid.voxelCount());
  std::mt19937 random(5);
  for (auto& value : volume.values) value = static_cast<std::uint16_t>(random() % 60000);
  return volume;
}

// Attenuation times volume: what all rays together see.
double mass(const AttenuationVolume& volume) {
  return std::accumulate(volume.values.begin(), volume.values.end(), 0.0) * volume.grid.spacing_mm.prod();
}

// Centre of mass in the CT frame.
Eigen::Vector3d massCentre(const AttenuationVolume& volume) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double total = 0.0;
  std::size_t i = 0;
  for (int z = 0; z < volume.grid.size.z(); ++z) {
    for (int y = 0; y < volume.grid.size.y(); ++y) {
      for (int x = 0; x < volume.grid.size.x(); ++x, ++i) {
        sum += volume.values[i] * (volume.grid.ctFromIndex() * Eigen::Vector3d(x, y, z));
        total += volume.values[i];
      }
    }
  }
  return sum / total;
}

TEST(Downsampled, AveragesBlocks) {
  const AttenuationVolume fine = randomVolume({8, 6, 9}, {1.0, 2.0, 0.5});
  const AttenuationVolume coarse = downsampled(fine, {2, 1, 3});
  ASSERT_EQ(coarse.grid.size, Eigen::Vector3i(4, 6, 3));
  EXPECT_LT((coarse.grid.spacing_mm - Eigen::Vector3d(2.0, 2.0, 1.5)).norm(), 1e-12);
  double sum = 0.0;
  for (int z = 3; z < 6; ++z) {
    for (int x = 4; x < 6; ++x) sum += fine.values[static_cast<std::size_t>((z * 6 + 5) * 8 + x)];
  }
  EXPECT_NEAR(coarse.values[static_cast<std::size_t>((1 * 6 + 5) * 4 + 2)], sum / 6.0, 0.51);  // Rounding.
}

TEST(Downsampled, KeepsTheBoxInSpace) {
  const AttenuationVolume fine = randomVolume({8, 6, 9}, {1.0, 2.0, 0.5});
  const auto before = fine.grid.cornersCt();
  const auto after = downsampled(fine, {2, 3, 3}).grid.cornersCt();
  for (std::size_t i = 0; i < 8; ++i) EXPECT_LT((before[i] - after[i]).norm(), 1e-9);
}

TEST(Downsampled, PartialBlocksKeepTheMassAtAFreeFaceAndTheDensityAtACutOne) {
  AttenuationVolume fine = randomVolume({5, 4, 4}, {1.0, 1.0, 1.0});
  std::fill(fine.values.begin(), fine.values.end(), std::uint16_t{1000});
  EXPECT_NEAR(mass(downsampled(fine, {2, 2, 2})), mass(fine), 1e-6);
  EXPECT_EQ(downsampled(fine, {2, 2, 2}).values[2], 500);
  fine.face_is_cut[1] = true;
  EXPECT_EQ(downsampled(fine, {2, 2, 2}).values[2], 1000);
  EXPECT_TRUE(downsampled(fine, {2, 2, 2}).face_is_cut[1]);
}

TEST(Downsampled, RefusesNonsense) {
  EXPECT_THROW(downsampled(AttenuationVolume{}, {2, 2, 2}), std::invalid_argument);
  EXPECT_THROW(downsampled(randomVolume({4, 4, 4}, {1, 1, 1}), {0, 2, 2}), std::invalid_argument);
}

TEST(Pyramid, MassAndItsCentreStay) {
  AttenuationVolume finest = randomVolume({101, 64, 50}, {1.0, 1.0, 1.0});
  // Air in the last blocks, which reach past the volume on some levels.
  for (std::size_t i = 0; i < finest.values.size(); ++i) {
    if (i % 101 >= 88 || i / (101 * 64) >= 40) finest.values[i] = 0;
  }
  const auto levels = coarserLevels(finest);
  ASSERT_GE(levels.size(), 2U);
  for (const AttenuationVolume& level : levels) {
    // Rounding to 16 bits of a mean near 30000.
    EXPECT_NEAR(mass(level) / mass(finest), 1.0, 1e-4);
    // A block's mass moves to its middle: a random volume's centre moves by thousandths of a millimetre, where a wrong
    // origin would move it by a half.
    EXPECT_LT((massCentre(level) - massCentre(finest)).norm(), 0.02);
    EXPECT_EQ(level.scale_per_mm, finest.scale_per_mm);
  }
}

TEST(Pyramid, AnisotropicBecomesIsotropic) {
  const auto levels = coarserLevels(randomVolume({256, 256, 28}, {0.45, 0.45, 5.0}), 24, 12.0);
  ASSERT_GE(levels.size(), 4U);
  EXPECT_EQ(levels[0].grid.size, Eigen::Vector3i(128, 128, 28));
  EXPECT_EQ(levels[2].grid.size, Eigen::Vector3i(32, 32, 28));
  // At 3.6 mm and 5 mm all axes are within a factor of 1.5.
  EXPECT_EQ(levels[3].grid.size, Eigen::Vector3i(16, 16, 14));
  EXPECT_EQ(levels.size(), 4U);  // No axis has 24 voxels any more.
}

TEST(Pyramid, EndsAtTheLargestSpacing) {
  const auto levels = coarserLevels(randomVolume({64, 64, 64}, {2.0, 2.0, 2.0}), 2, 8.0);
  ASSERT_EQ(levels.size(), 2U);
  EXPECT_DOUBLE_EQ(levels.back().grid.spacing_mm.x(), 8.0);
}

TEST(Pyramid, TinyVolumesHaveNoOtherLevel) {
  EXPECT_TRUE(coarserLevels(randomVolume({5, 4, 3}, {1, 1, 1})).empty());
  EXPECT_EQ(coarserLevels(randomVolume({40, 1, 1}, {1, 1, 1}), 2).back().grid.size.y(), 1);
}

TEST(Fitted, LeavesWhatFits) {
  const AttenuationVolume volume = randomVolume({10, 10, 10}, {1, 1, 1});
  std::string said;
  const AttenuationVolume same = fittedTo(volume, 2000, [&said](LogLevel, const std::string& text) { said += text; });
  EXPECT_EQ(same.values, volume.values);
  EXPECT_TRUE(said.empty());
}

TEST(Fitted, ShrinksWithAWarningThatGivesBothSizes) {
  const AttenuationVolume volume = randomVolume({60, 50, 20}, {0.5, 0.5, 2.0});
  LogLevel level = LogLevel::kDebug;
  std::string said;
  const std::size_t max_bytes = 30000;
  const AttenuationVolume small = fittedTo(volume, max_bytes, [&](LogLevel l, const std::string& text) {
    level = l;
    said += text;
  });
  EXPECT_LE(small.values.size() * 2, max_bytes);
  EXPECT_GE(small.values.size() * 2, max_bytes / 2);  // No more is given up than needed.
  EXPECT_EQ(small.grid.size.z(), 20);                 // The coarse axis keeps its voxels.
  EXPECT_EQ(level, LogLevel::kWarning);
  EXPECT_NE(said.find("60x50x20"), std::string::npos);
  EXPECT_NE(said.find(std::to_string(small.grid.size.x()) + "x"), std::string::npos);
  // Rounding to 16 bits, and the weights' to float.
  EXPECT_NEAR(mass(small) / mass(volume), 1.0, 1e-4);
  const auto before = volume.grid.cornersCt();
  const auto after = small.grid.cornersCt();
  for (std::size_t i = 0; i < 8; ++i) EXPECT_LT((before[i] - after[i]).norm(), 1e-9);
}

TEST(Fitted, NeverFailsHoweverLittleThereIs) {
  const AttenuationVolume volume = randomVolume({30, 20, 10}, {1, 1, 1});
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{100}}) {
    const AttenuationVolume small = fittedTo(volume, bytes, {});
    EXPECT_GE(small.values.size(), 1U);
    EXPECT_LE(small.values.size() * 2, std::max<std::size_t>(bytes, 2));
  }
}

// 512³ voxels, converted and fitted: 0.8 GB for a moment. A ball, so that the result can be checked.
TEST(Fitted, TheLargestCtGoesThrough) {
  Volume ct;
  ct.name = "large";
  ct.grid.size = {512, 512, 512};
  ct.grid.spacing_mm = {0.5, 0.5, 0.5};
  ct.hu.assign(ct.grid.voxelCount(), -1000);
  for (int z = 128; z < 384; ++z) {
    for (int y = 128; y < 384; ++y) {
      const auto row = ct.hu.begin() + (static_cast<std::ptrdiff_t>(z) * 512 + y) * 512;
      std::fill(row + 128, row + 384, std::int16_t{0});
    }
  }
  AttenuationVolume attenuation = toAttenuation(ct, {});
  ct.hu = {};
  const AttenuationVolume fitted = fittedTo(std::move(attenuation), std::size_t{32} << 20, {});
  EXPECT_LE(fitted.values.size() * 2, std::size_t{32} << 20);
  EXPECT_EQ(fitted.grid.size, Eigen::Vector3i(256, 256, 256));
  EXPECT_NEAR(mass(fitted), 65535.0 * 128.0 * 128.0 * 128.0, 1.0);
}

}  // namespace
}  // namespace xray_registration
