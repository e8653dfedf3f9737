// Far from any start, with X-rays by the exact projector.
#include "xray_registration/registration/wide_search.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/registration/fast_registrar.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

/// A head whose left and right differ by two lumps of bone, as in anybody's they do by less.
AttenuationVolume lopsidedHead(double spacing_mm) {
  Volume head = headPhantom(spacing_mm);
  const Eigen::Vector3d centre = head.grid.centreCt();
  std::size_t at = 0;
  for (int z = 0; z < head.grid.size.z(); ++z) {
    for (int y = 0; y < head.grid.size.y(); ++y) {
      for (int x = 0; x < head.grid.size.x(); ++x, ++at) {
        const Eigen::Vector3d point = head.grid.ctFromIndex() * Eigen::Vector3d(x, y, z) - centre;
        const bool in_lump = (point - Eigen::Vector3d(35.0, 20.0, 15.0)).norm() < 14.0 ||
                             (point - Eigen::Vector3d(20.0, -35.0, -20.0)).norm() < 10.0;
        if (in_lump) head.hu[at] = 1500;
      }
    }
  }
  return toAttenuation(head, {});
}

/// Such a head from the side, as a small and a further view see it.
class WideSearchTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    registrar_ = std::make_unique<FastRegistrar>(std::make_shared<Device>(), RegistrarOptions{}, Logger{});
    registrar_->setVolume(lopsidedHead(4.0));
    truth_.linear() << 0, 1, 0, 0, 0, -1, -1, 0, 0;
    truth_.linear() = rotationFromVector({0.1, 0.3, -0.05}) * truth_.linear();
    truth_.translation() = Eigen::Vector3d(13.0, -25.0, 780.0) - truth_.linear() * registrar_->centreCt();
    const AttenuationVolume body = lopsidedHead(3.0);
    XrayFrame side;
    side.camera = {128, 128, 390.0, 390.0, 63.5, 63.5};
    side.attenuation = referenceProjection(body, truth_, side.camera);
    views_ = {side};
    XrayFrame front = side;
    RigidTransform T_view_first = RigidTransform::Identity();
    T_view_first.linear() = rotationFromVector({0.0, 1.4, 0.0});
    T_view_first.translation() = Eigen::Vector3d(0, 0, 790) - T_view_first.linear() * Eigen::Vector3d(0, 0, 790);
    front.attenuation = referenceProjection(body, T_view_first * truth_, front.camera);
    both_ = {views_.front(), ViewInput(std::make_shared<const XrayFrame>(front), T_view_first)};
  }
  static void TearDownTestSuite() {
    views_.clear();
    both_.clear();
    registrar_.reset();
  }

  static RigidTransform off(const Eigen::Vector3d& mm, const Eigen::Vector3d& rad) {
    Twist twist;
    twist << mm, rad;
    return updatedPose(truth_, twist, truth_ * registrar_->centreCt());
  }

  static std::vector<RigidTransform> run(const std::vector<ViewInput>& views, const WideSearchRange& range) {
    const std::unique_ptr<WideSearch> search = registrar_->searchWidely(views, range);
    double progress = 0.0;
    while (search->advance()) {
      EXPECT_GE(search->progress(), progress);
      EXPECT_LE(search->progress(), 1.0);
      EXPECT_TRUE(search->places().empty());
      progress = search->progress();
    }
    EXPECT_EQ(search->progress(), 1.0);
    EXPECT_FALSE(search->advance());
    return search->places();
  }

  static PoseError errorOf(const RigidTransform& T_camera_ct) {
    return poseError(T_camera_ct, truth_, targetGrid(registrar_->centreCt(), 100.0));
  }

  static void expectFound(const std::vector<ViewInput>& views, const WideSearchRange& range) {
    const std::vector<RigidTransform> places = run(views, range);
    ASSERT_FALSE(places.empty());
    // Where a search in 22 mm and 0.22 rad finds the rest of the way.
    EXPECT_LT(errorOf(places.front()).inplane_mm, 10.0);
    const RegistrationResult result = registrar_->registerAmong(views, places);
    EXPECT_TRUE(result.accepted) << result.reason;
    EXPECT_LT(errorOf(result.T_camera_ct).inplane_mm, 0.5);  // As from a near start; voxels of 4 mm.
  }

  static WideSearchRange range(const RigidTransform& centre) { return {centre, 1.0, 100.0, 450.0, 1100.0}; }

  static std::unique_ptr<FastRegistrar> registrar_;
  static RigidTransform truth_;
  static std::vector<ViewInput> views_, both_;
};
std::unique_ptr<FastRegistrar> WideSearchTest::registrar_;
RigidTransform WideSearchTest::truth_ = RigidTransform::Identity();
std::vector<ViewInput> WideSearchTest::views_;
std::vector<ViewInput> WideSearchTest::both_;

TEST_F(WideSearchTest, FindsWhatIsFarFromTheStart) {
  expectFound(views_, range(off({90.0, -70.0, 60.0}, {0.5, -0.4, 0.5})));
}

TEST_F(WideSearchTest, FindsItInTwoViews) { expectFound(both_, range(off({-80.0, 60.0, 90.0}, {-0.4, 0.6, -0.3}))); }

TEST_F(WideSearchTest, FindsItFromNothing) { expectFound(views_, {}); }

TEST_F(WideSearchTest, FindsItFromNothingInTwoViews) { expectFound(both_, {}); }

TEST_F(WideSearchTest, GivesTheSamePlacesEveryTime) {
  const WideSearchRange around = range(off({50.0, 0.0, 0.0}, {0.3, 0.0, 0.0}));
  const std::vector<RigidTransform> first = run(views_, around);
  const std::vector<RigidTransform> second = run(views_, around);
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) EXPECT_TRUE(first[i].matrix() == second[i].matrix());
}

TEST_F(WideSearchTest, AResultHasToStandAboveTheOtherPlaces) {
  // The right place twice, one of them called another: nothing distinguishes them, but they are one place.
  const RigidTransform near = off({1.0, 0.5, 2.0}, {0.01, 0.0, 0.01});
  const RegistrationResult alone = registrar_->registerAmong(views_, {near});
  const RegistrationResult among = registrar_->registerAmong(
      views_, {off({60.0, 40.0, 0.0}, {0.4, 0.0, 0.2}), near, off({-60.0, 0.0, 0.0}, {0, 0, 0})});
  EXPECT_TRUE(alone.accepted) << alone.reason;
  EXPECT_TRUE(among.accepted) << among.reason;
  EXPECT_LT(errorOf(among.T_camera_ct).inplane_mm, 0.5);
}

TEST_F(WideSearchTest, AnXrayOfNothingIsNotAccepted) {
  XrayFrame noise = *views_.front().xray;
  std::uint32_t state = 1;
  for (float& pixel : noise.attenuation.floats().pixels) {
    state = state * 1664525U + 1013904223U;
    pixel = static_cast<float>(state >> 8U) / static_cast<float>(1U << 24U);
  }
  const std::vector<ViewInput> views = {ViewInput(noise)};
  const std::vector<RigidTransform> places = run(views, range(truth_));
  ASSERT_FALSE(places.empty());
  const RegistrationResult result = registrar_->registerAmong(views, places);
  EXPECT_FALSE(result.accepted);
  EXPECT_FALSE(result.reason.empty());
}

/// A head is much alike on both sides: mirrored, it looks like one from its other side.
TEST_F(WideSearchTest, AMirroredXrayIsNotAcceptedFromTheOtherSide) {
  XrayFrame mirrored = *views_.front().xray;
  for (int v = 0; v < mirrored.camera.height; ++v) {
    const auto row =
        mirrored.attenuation.floats().pixels.begin() + static_cast<std::ptrdiff_t>(v) * mirrored.camera.width;
    std::reverse(row, row + mirrored.camera.width);
  }
  const std::vector<ViewInput> views = {ViewInput(mirrored)};
  const RegistrationResult result = registrar_->registerAmong(views, run(views, {}));
  EXPECT_FALSE(result.accepted) << result.similarity << " at " << errorOf(result.T_camera_ct).inplane_mm << " mm";
}

TEST_F(WideSearchTest, NeedsACt) {
  FastRegistrar empty(std::make_shared<Device>(), RegistrarOptions{}, Logger{});
  EXPECT_EQ(empty.searchWidely(views_, range(truth_)), nullptr);
}

}  // namespace
}  // namespace xray_registration
