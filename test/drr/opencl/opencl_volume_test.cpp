#include "xray_registration/drr/opencl/opencl_volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "xray_registration/drr/engine.h"
#include "xray_registration/volume/volume_pyramid.h"

namespace xray_registration {
namespace {

const XrayCamera kCamera{72, 64, 420.0, 420.0, 35.0, 32.0};

AttenuationVolume air(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm = {1, 1, 1}) {
  AttenuationVolume volume;
  volume.grid.size = size;
  volume.grid.spacing_mm = spacing_mm;
  volume.grid.origin_ct_mm = {30.0, -12.0, 105.0};
  volume.scale_per_mm = 1e-6F;
  volume.values.assign(volume.grid.voxelCount(), 0);
  return volume;
}

std::uint16_t& voxel(AttenuationVolume* volume, const Eigen::Vector3i& at) {
  const Eigen::Vector3i n = volume->grid.size;
  return volume
      ->values[(static_cast<std::size_t>(at.z()) * static_cast<std::size_t>(n.y()) + static_cast<std::size_t>(at.y())) *
                   static_cast<std::size_t>(n.x()) +
               static_cast<std::size_t>(at.x())];
}

/// Values that change from voxel to voxel, so that no shift goes unseen.
AttenuationVolume rough(const Eigen::Vector3i& size, const Eigen::Vector3d& spacing_mm = {1, 1, 1}) {
  AttenuationVolume volume = air(size, spacing_mm);
  std::mt19937 random(17);
  std::uniform_int_distribution<int> value(1000, 40000);
  for (std::uint16_t& v : volume.values) v = static_cast<std::uint16_t>(value(random));
  return volume;
}

/// The same tissue with layers of air around it.
AttenuationVolume padded(const AttenuationVolume& inner, const Eigen::Vector3i& low, const Eigen::Vector3i& high) {
  AttenuationVolume volume = air(inner.grid.size + low + high, inner.grid.spacing_mm);
  volume.grid.direction = inner.grid.direction;
  volume.grid.origin_ct_mm = inner.grid.ctFromIndex() * Eigen::Vector3d(-low.cast<double>());
  AttenuationVolume source = inner;
  for (int z = 0; z < inner.grid.size.z(); ++z) {
    for (int y = 0; y < inner.grid.size.y(); ++y) {
      for (int x = 0; x < inner.grid.size.x(); ++x) {
        voxel(&volume, Eigen::Vector3i(x, y, z) + low) = voxel(&source, {x, y, z});
      }
    }
  }
  return volume;
}

/// Looking at a point of the CT along an axis, a little askew.
RigidTransform poseTowards(const Eigen::Vector3d& point_ct_mm, const Eigen::Vector3d& axis, double depth_mm = 260.0) {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector({0.09, -0.06, 0.25}) *
                  Eigen::Quaterniond::FromTwoVectors(axis, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(1.0, -2.0, depth_mm) - pose.linear() * point_ct_mm;
  return pose;
}

const std::vector<Eigen::Vector3d>& axes() {
  static const std::vector<Eigen::Vector3d> all = {
      Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),   -Eigen::Vector3d::UnitY(),
      Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ(), Eigen::Vector3d(1, 0.9, 0), Eigen::Vector3d(0.5, -1, 1)};
  return all;
}

double largest(const FloatImage& image) { return *std::max_element(image.pixels.begin(), image.pixels.end()); }

double largestDifference(const FloatImage& a, const FloatImage& b) {
  double difference = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    difference = std::max(difference, std::abs(static_cast<double>(a.pixels[i]) - b.pixels[i]));
  }
  return difference;
}

class OpenClVolumeTest : public testing::Test {
 protected:
  std::shared_ptr<Device> device_ = std::make_shared<Device>();
};

TEST_F(OpenClVolumeTest, LevelsAreThePyramidsLevels) {
  const AttenuationVolume volume = rough({70, 64, 40}, {0.8, 0.9, 1.7});
  const OpenClVolume resident(*device_, volume);
  std::vector<AttenuationVolume> pyramid = coarserLevels(volume);
  pyramid.insert(pyramid.begin(), volume);
  ASSERT_EQ(resident.levels().size(), pyramid.size());
  ASSERT_GE(pyramid.size(), 2U);
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < pyramid.size(); ++i) {
    const OpenClLevel& level = resident.levels()[i];
    EXPECT_NEAR(level.spacing_mm, std::cbrt(pyramid[i].grid.spacing_mm.prod()), 1e-9);
    const Eigen::Vector3i size(level.grid.size[0], level.grid.size[1], level.grid.size[2]);
    EXPECT_EQ(size, pyramid[i].grid.size + Eigen::Vector3i::Constant(4)) << "two layers of air on every side";
    const std::size_t words = static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y()) *
                              static_cast<std::size_t>(size.z()) * (hasVoxels16(*device_) ? 6 : 4);
    EXPECT_EQ(level.grid.has_voxels != 0, hasVoxels16(*device_));
    EXPECT_EQ(level.words.getInfo<CL_MEM_SIZE>(), words);
    EXPECT_EQ(level.bytes, words + level.occupancy.getInfo<CL_MEM_SIZE>());
    bytes += level.bytes;
    // The first voxel of tissue stands behind the two layers.
    const Eigen::Vector3d place = level.index_from_ct * pyramid[i].grid.origin_ct_mm;
    EXPECT_LT((place - Eigen::Vector3d::Constant(2.0)).norm(), 1e-9);
  }
  EXPECT_EQ(resident.description().bytes(), bytes);
}

TEST_F(OpenClVolumeTest, PixelsChooseTheirLevel) {
  const OpenClVolume resident(*device_, rough({100, 100, 100}));
  ASSERT_GE(resident.levels().size(), 3U);
  EXPECT_EQ(resident.description().levelFor(0.01), 0);
  EXPECT_EQ(resident.description().levelFor(1.0), 0);
  EXPECT_EQ(resident.description().levelFor(2.0), 1);
  EXPECT_EQ(resident.description().levelFor(4.5), 2);
  EXPECT_EQ(resident.description().levelFor(1e9), static_cast<int>(resident.levels().size()) - 1);
  EXPECT_EQ(resident.description().levelFor(std::nan("")), 0);
}

TEST_F(OpenClVolumeTest, CentreAndRadiusAreTheTissues) {
  const AttenuationVolume inner = rough({20, 30, 16}, {1.5, 1.0, 2.0});
  const AttenuationVolume volume = padded(inner, {20, 3, 9}, {0, 14, 30});
  const OpenClVolume resident(*device_, volume);
  EXPECT_LT((resident.description().centreCt() - inner.grid.centreCt()).norm(), 1e-6);
  EXPECT_NEAR(resident.description().radiusMm(), 0.5 * Eigen::Vector3d(30, 30, 32).norm(), 1e-6);
}

TEST_F(OpenClVolumeTest, AirAroundTheBodyChangesNoPicture) {
  AttenuationVolume inner = rough({26, 24, 22}, {1.1, 1.0, 1.3});
  inner.grid.direction = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const AttenuationVolume outer = padded(inner, {33, 7, 0}, {2, 40, 19});
  const std::unique_ptr<Engine> tight = makeEngineOpenCl(device_);
  const std::unique_ptr<Engine> loose = makeEngineOpenCl(device_);
  tight->setVolume(inner);
  loose->setVolume(outer);
  EXPECT_EQ(loose->volume().levels()[0].bytes, tight->volume().levels()[0].bytes);
  for (const Eigen::Vector3d& axis : axes()) {
    const RigidTransform pose = poseTowards(inner.grid.centreCt(), axis);
    const FloatImage drr = tight->render(kCamera, 0, pose);
    ASSERT_GT(largest(drr), 0.1);
    // Single precision: the grids' origins differ in the last digit.
    EXPECT_LT(largestDifference(drr, loose->render(kCamera, 0, pose)), 1e-4 * largest(drr)) << axis.transpose();
  }
}

TEST_F(OpenClVolumeTest, ALargeCtIsSeenAsASmallOne) {
  // A CPU reads what runs along z from the voxels of a small CT and from the words of a large one.
  const AttenuationVolume small = rough({40, 36, 44});
  const Eigen::Vector3i low(180, 182, 93);
  AttenuationVolume large = padded(small, low, {180, 182, 93});
  for (const int corner : {0, 1}) voxel(&large, corner * (large.grid.size - Eigen::Vector3i::Ones()).eval()) = 1;
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  const std::unique_ptr<Engine> large_engine = makeEngineOpenCl(device_);
  engine->setVolume(small);
  large_engine->setVolume(large);
  ASSERT_EQ(openClVolume(*large_engine).levels()[0].grid.has_voxels, 0);
  ASSERT_EQ(openClVolume(*engine).levels()[0].grid.has_voxels != 0, hasVoxels16(*device_));
  for (const Eigen::Vector3d& axis : axes()) {
    const RigidTransform pose = poseTowards(small.grid.centreCt(), axis);
    const FloatImage drr = engine->render(kCamera, 0, pose);
    ASSERT_GT(largest(drr), 0.1);
    // Single precision, with coordinates of hundreds of voxels: a thousandth of a voxel of what changes by it.
    EXPECT_LT(largestDifference(drr, large_engine->render(kCamera, 0, pose)), 2e-3 * largest(drr)) << axis.transpose();
  }
}

TEST_F(OpenClVolumeTest, AirAroundTheBodyChangesNoCoarsePicture) {
  const AttenuationVolume inner = rough({48, 48, 48});
  // Whole voxels of the coarser levels, or the levels' blocks would begin elsewhere.
  const AttenuationVolume outer = padded(inner, {16, 16, 16}, {16, 0, 32});
  const std::unique_ptr<Engine> tight = makeEngineOpenCl(device_);
  const std::unique_ptr<Engine> loose = makeEngineOpenCl(device_);
  tight->setVolume(inner);
  loose->setVolume(outer);
  const std::size_t levels = std::min(tight->volume().levels().size(), loose->volume().levels().size());
  ASSERT_GE(levels, 2U);
  const RigidTransform pose = poseTowards(inner.grid.centreCt(), Eigen::Vector3d(0.2, 1, -0.4));
  for (int level = 0; level < static_cast<int>(levels); ++level) {
    const FloatImage drr = tight->render(kCamera, level, pose);
    EXPECT_LT(largestDifference(drr, loose->render(kCamera, level, pose)), 1e-4 * largest(drr)) << "level " << level;
  }
}

TEST_F(OpenClVolumeTest, ASingleVoxelIsSeenWhereverItIs) {
  const Eigen::Vector3i size(27, 19, 22);
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  std::vector<Eigen::Vector3i> places;
  for (int corner = 0; corner < 8; ++corner) {
    places.emplace_back(corner & 1 ? size.x() - 1 : 0, corner & 2 ? size.y() - 1 : 0, corner & 4 ? size.z() - 1 : 0);
  }
  for (const Eigen::Vector3i& inside :
       {Eigen::Vector3i(7, 8, 9), Eigen::Vector3i(15, 16, 5), Eigen::Vector3i(6, 13, 14)}) {
    places.push_back(inside);
  }
  for (const Eigen::Vector3i& place : places) {
    AttenuationVolume volume = air(size);
    voxel(&volume, place) = 50000;
    engine->setVolume(volume);
    const Eigen::Vector3d point = volume.grid.ctFromIndex() * place.cast<double>();
    EXPECT_LT((engine->volume().centreCt() - point).norm(), 1e-9);
    for (const Eigen::Vector3d& axis : axes()) {
      // The voxel's centre on the centre of a pixel, beside the image's middle.
      RigidTransform pose = poseTowards(point, axis);
      pose.translation() += 262.0 * kCamera.rayDirection(50, 13) - pose * point;
      const FloatImage drr = engine->render(kCamera, 0, pose);
      // A ray through a voxel's centre crosses it on at least a millimetre's length of a tent.
      EXPECT_GT(drr.at(50, 13), 0.8 * 0.05) << place.transpose() << " along " << axis.transpose();
      EXPECT_LT(drr.at(50, 13), 2.0 * 0.05) << place.transpose() << " along " << axis.transpose();
      EXPECT_EQ(drr.at(20, 50), 0.0F);
    }
  }
}

TEST_F(OpenClVolumeTest, BricksWithoutTissueHideNothing) {
  // The same few voxels once in air, whose bricks are left out, and once in the faintest tissue, where none is.
  std::mt19937 random(23);
  const std::unique_ptr<Engine> sparse_engine = makeEngineOpenCl(device_);
  const std::unique_ptr<Engine> full_engine = makeEngineOpenCl(device_);
  for (int trial = 0; trial < 6; ++trial) {
    AttenuationVolume sparse = air({41, 37, 46});
    const Eigen::Vector3i last = sparse.grid.size - Eigen::Vector3i::Ones();
    voxel(&sparse, {0, 0, 0}) = 60000;
    voxel(&sparse, last) = 60000;
    for (int i = 0; i < 3 + trial; ++i) {
      const auto any = [&](int limit) { return std::uniform_int_distribution<int>(0, limit)(random); };
      voxel(&sparse, {any(last.x()), any(last.y()), any(last.z())}) = 60000;
    }
    AttenuationVolume full = sparse;
    for (std::uint16_t& value : full.values) value = std::max<std::uint16_t>(value, 1);
    sparse_engine->setVolume(sparse);
    full_engine->setVolume(full);
    for (const Eigen::Vector3d& axis : axes()) {
      const RigidTransform pose = poseTowards(sparse.grid.centreCt(), axis);
      const FloatImage drr = sparse_engine->render(kCamera, 0, pose);
      // 80 mm of the faintest tissue: 1e-6 per mm; a hidden voxel would lack up to 0.06, a grazed one a part of that.
      EXPECT_LT(largestDifference(drr, full_engine->render(kCamera, 0, pose)), 1.2e-4) << axis.transpose();
      EXPECT_GT(largest(drr), 0.01);
    }
  }
}

TEST_F(OpenClVolumeTest, CutFacesReachTheDevice) {
  AttenuationVolume volume = rough({24, 24, 24});
  volume.face_is_cut = {false, true, false, false, true, false};
  const OpenClVolume resident(*device_, volume);
  EXPECT_EQ(resident.levels()[0].cut_faces, (1 << 1) | (1 << 4));
}

TEST_F(OpenClVolumeTest, AVolumeOfAirGivesEmptyPictures) {
  const std::unique_ptr<Engine> engine = makeEngineOpenCl(device_);
  engine->setVolume(air({20, 20, 20}));
  const FloatImage drr = engine->render(kCamera, 0, poseTowards({40, 0, 115}, Eigen::Vector3d::UnitZ()));
  EXPECT_EQ(drr.pixels, std::vector<float>(drr.pixels.size(), 0.0F));
  EXPECT_TRUE(engine->volume().centreCt().allFinite());
  EXPECT_TRUE(std::isfinite(engine->volume().radiusMm()));
}

TEST_F(OpenClVolumeTest, TheLimitsAreHeldBeforeAnythingIsUploaded) {
  VolumeLimits limits = volumeLimits(*device_);
  EXPECT_EQ(limits.words, 0x7fffffffU);
  limits.words = 28 * 28 * 28;
  EXPECT_NO_THROW(OpenClVolume(*device_, rough({24, 24, 24}), limits));
  EXPECT_THROW(OpenClVolume(*device_, rough({25, 24, 24}), limits), DeviceError);
}

TEST_F(OpenClVolumeTest, MemoryStaysWithinItsBudget) {
  // The body of a CT: a cylinder with air around, as scanners give it.
  AttenuationVolume volume = air({160, 160, 140});
  for (int z = 0; z < 140; ++z) {
    for (int y = 0; y < 160; ++y) {
      for (int x = 0; x < 160; ++x) {
        if (std::hypot(x - 79.5, y - 79.5) < 75.0) voxel(&volume, {x, y, z}) = 20000;
      }
    }
  }
  const OpenClVolume resident(*device_, volume);
  EXPECT_LE(resident.description().bytes(), volume.values.size() * sizeof(std::uint16_t) * 7 / 2);
  EXPECT_GT(resident.description().bytes(), volume.values.size() * sizeof(std::uint16_t));
  // Where a buffer has no room for more, words alone.
  VolumeLimits limits = volumeLimits(*device_);
  limits.buffer_bytes = volume.values.size() * sizeof(cl_uint);
  const OpenClVolume words(*device_, volume, limits);
  EXPECT_EQ(words.levels().front().grid.has_voxels, 0);
  EXPECT_LE(words.levels().front().bytes, limits.buffer_bytes);
}

}  // namespace
}  // namespace xray_registration
