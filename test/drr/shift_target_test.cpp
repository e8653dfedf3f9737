// DRRs against small X-rays at all shifts: the device's correlations against the same in double on the host.
#include "xray_registration/drr/shift_target.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "xray_registration/drr/engine.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

/// Single precision over a thousand pixels, compared with double.
constexpr double kTolerance = 2e-3;

class Shifts : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    engine_ = makeEngineOpenCl(std::make_shared<Device>());
    engine_->setVolume(toAttenuation(headPhantom(6.0), {}));
  }
  static void TearDownTestSuite() { engine_.reset(); }

  static RigidTransform pose(double x_mm, double y_mm, double turn_rad) {
    RigidTransform T = RigidTransform::Identity();
    T.linear() = rotationFromVector({turn_rad, 0.2, 0.1}) * rotationFromVector({1.4, 0.0, 0.0});
    T.translation() = Eigen::Vector3d(x_mm, y_mm, 800.0) - T.linear() * engine_->volume().centreCt();
    return T;
  }

  /// 30 × 26 pixels of 8 mm at the head's depth; a corner of it is not to be used.
  static ShiftTarget target(const RigidTransform& T_camera_ct) {
    ShiftTarget target;
    target.camera = {30, 26, 100.0, 100.0, 14.5, 12.5};
    target.attenuation = engine_->render(target.camera, 0, T_camera_ct);
    target.mask = MaskImage(30, 26, 255);
    for (int v = 0; v < 6; ++v) {
      for (int u = 0; u < 9; ++u) target.mask.at(u, v) = 0;
    }
    target.reach = 4;
    return target;
  }

  /// Of the pixels of the target that `counts` lets through, with the DRR moved as the engine says.
  template <typename Counts>
  static double correlation(const ShiftTarget& target, const FloatImage& xray, const FloatImage& drr, int column,
                            int row, const Counts& counts) {
    double n = 0.0, x = 0.0, t = 0.0, xx = 0.0, tt = 0.0, xt = 0.0;
    for (int v = 0; v < xray.height; ++v) {
      for (int u = 0; u < xray.width; ++u) {
        if (target.mask.at(u, v) == 0 || !counts(u + column, v + row)) continue;
        const double a = xray.at(u, v);
        const double b = drr.at(u + column, v + row);
        n += 1.0;
        x += a;
        t += b;
        xx += a * a;
        tt += b * b;
        xt += a * b;
      }
    }
    return (xt - x * t / n) / std::sqrt((xx - x * x / n) * (tt - t * t / n));
  }

  static std::unique_ptr<Engine> engine_;
};
std::unique_ptr<Engine> Shifts::engine_;

TEST_F(Shifts, AgreeWithTheHostOverWholeImages) {
  const ShiftTarget xray = target(pose(3.0, -5.0, 0.0));
  const std::vector<RigidTransform> poses = {pose(0.0, 0.0, 0.1), pose(10.0, 5.0, -0.3), pose(-8.0, 20.0, 0.6)};
  const std::vector<float> found = engine_->matchShifts(xray, 0, poses);
  const int shifts = xray.shifts();
  ASSERT_EQ(found.size(), poses.size() * static_cast<std::size_t>(shifts * shifts));
  std::size_t at = 0;
  for (const RigidTransform& T : poses) {
    const FloatImage drr = engine_->render(xray.widened(), 0, T);
    for (int row = 0; row < shifts; ++row) {
      for (int column = 0; column < shifts; ++column) {
        const double expected = correlation(xray, xray.attenuation, drr, column, row, [](int, int) { return true; });
        EXPECT_NEAR(found[at++], expected, kTolerance) << column << ", " << row;
      }
    }
  }
}

TEST_F(Shifts, AgreeWithTheHostWhereTheCtIsSeen) {
  ShiftTarget xray = target(pose(3.0, -5.0, 0.0));
  xray.detail_radius = 3;
  const RigidTransform T = pose(4.0, 8.0, 0.2);
  const std::vector<float> found = engine_->matchShifts(xray, 0, {T});
  const FloatImage drr = engine_->render(xray.widened(), 0, T);
  const FloatImage xray_detail = detailOf(xray.attenuation, xray.mask, 3);
  const FloatImage drr_detail = detailOf(drr, MaskImage(drr.width, drr.height, 255), 3);
  const auto is_shown = [&](int u, int v) {
    for (int y = std::max(v - 1, 0); y <= std::min(v + 1, drr.height - 1); ++y) {
      for (int x = std::max(u - 1, 0); x <= std::min(u + 1, drr.width - 1); ++x) {
        if (drr.at(x, y) > 0.05F) return true;
      }
    }
    return false;
  };
  std::size_t at = 0;
  for (int row = 0; row < xray.shifts(); ++row) {
    for (int column = 0; column < xray.shifts(); ++column) {
      EXPECT_NEAR(found[at++], correlation(xray, xray_detail, drr_detail, column, row, is_shown), kTolerance);
    }
  }
}

TEST_F(Shifts, TheBestShiftIsWhereTheCtIs) {
  // Pixels of 8 mm: two to the right, three up.
  const ShiftTarget xray = target(pose(16.0, -24.0, 0.0));
  for (const int radius : {0, 3}) {
    ShiftTarget sought = xray;
    sought.detail_radius = radius;
    const std::vector<float> found = engine_->matchShifts(sought, 0, {pose(0.0, 0.0, 0.0)});
    const auto best = static_cast<int>(std::max_element(found.begin(), found.end()) - found.begin());
    EXPECT_EQ(best % xray.shifts(), xray.reach - 2);
    EXPECT_EQ(best / xray.shifts(), xray.reach + 3);
    // At the border, the X-ray's surroundings end where the DRR's go on.
    EXPECT_GT(found[static_cast<std::size_t>(best)], 0.9F);
  }
}

TEST_F(Shifts, NothingToCompareIsMinusOne) {
  ShiftTarget xray = target(pose(0.0, 0.0, 0.0));
  const RigidTransform beside = pose(5000.0, 0.0, 0.0);
  for (const int radius : {0, 3}) {
    xray.detail_radius = radius;
    for (const float value : engine_->matchShifts(xray, 0, {beside})) EXPECT_EQ(value, -1.0F);
  }
  EXPECT_TRUE(engine_->matchShifts(xray, 0, {}).empty());
}

TEST(DetailOf, IsTheDifferenceFromTheMeanOfWhatIsUsed) {
  FloatImage image(3, 3, 1.0F);
  image.at(1, 1) = 10.0F;
  image.at(0, 0) = 100.0F;
  MaskImage mask(3, 3, 255);
  mask.at(0, 0) = 0;
  const FloatImage detail = detailOf(image, mask, 1);
  EXPECT_FLOAT_EQ(detail.at(1, 1), 10.0F - 17.0F / 8.0F);
  EXPECT_FLOAT_EQ(detail.at(0, 0), 0.0F);  // Not used.
}

}  // namespace
}  // namespace xray_registration
