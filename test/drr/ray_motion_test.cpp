#include "xray_registration/drr/ray_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "xray_registration/drr/engine.h"
#include "xray_registration/drr/window_evidence.h"
#include "xray_registration/volume/phantom.h"
#include "xray_registration/volume/volume_pyramid.h"

namespace xray_registration {
namespace {

const XrayCamera kCamera{96, 88, 420.0, 430.0, 45.0, 46.5};
constexpr double kDepthMm = 420.0;

/// A head, seen askew so that no axis is special.
class RayMotionTest : public ::testing::Test {
 protected:
  RayMotionTest() {
    engine_->setVolume(volume_);
    pose_.linear() = rotationFromVector({0.3, -0.5, 0.9});
    pose_.translation() = Eigen::Vector3d(3.0, -5.0, kDepthMm) - pose_.linear() * engine_->volume().centreCt();
    const FloatImage drr = engine_->render(kCamera, 0, pose_);
    xray_ = engine_->upload(kCamera, drr, FloatImage(kCamera.width, kCamera.height, 1.0F));
  }

  Eigen::Vector3d centre() const { return pose_ * engine_->volume().centreCt(); }

  TileProducts products(const XrayCamera& camera, const Eigen::Affine3d& T_camera_ct,
                        const std::vector<RayMotion>& motions) {
    return engine_->addUpTiles(xray_.get(), 0, 0, camera, T_camera_ct, motions);
  }

  /// Σ DRR over each tile, absolute.
  std::vector<double> tileSums(const XrayCamera& camera, const Eigen::Affine3d& T_camera_ct) {
    const TileProducts sums = products(camera, T_camera_ct, {});
    std::vector<double> totals;
    for (int y = 0; y < sums.tiles_y; ++y) {
      for (int x = 0; x < sums.tiles_x; ++x) {
        const float* tile = sums.tile(x, y);
        totals.push_back(tile[1] + static_cast<double>(tile[sums.pairs()]) * tile[0]);
      }
    }
    return totals;
  }

  /// Relative difference between the motion's derivative and finite differences, over all tiles.
  double differenceFor(const RayMotion& motion, double step,
                       const std::function<std::vector<double>(double)>& sums_at) {
    const TileProducts exact = products(kCamera, pose_, {motion});
    const std::vector<double> plus = sums_at(step);
    const std::vector<double> minus = sums_at(-step);
    double difference2 = 0.0;
    double size2 = 0.0;
    std::size_t i = 0;
    for (int y = 0; y < exact.tiles_y; ++y) {
      for (int x = 0; x < exact.tiles_x; ++x, ++i) {
        const double finite = (plus[i] - minus[i]) / (2.0 * step);
        difference2 += std::pow(finite - exact.tile(x, y)[3], 2);
        size2 += finite * finite;
      }
    }
    EXPECT_GT(size2, 0.0);
    return std::sqrt(difference2 / size2);
  }

  AttenuationVolume volume_ = toAttenuation(headPhantom(2.0), AttenuationModel{});
  std::unique_ptr<Engine> engine_ = makeEngineOpenCl(std::make_shared<Device>("auto"));
  RigidTransform pose_ = RigidTransform::Identity();
  std::unique_ptr<ResidentXray> xray_;
};

// Bilinear cells make derivatives jump at their borders, and a tile's sum averages that over 64 rays of some hundred
// cells each: 1.2 % are seen. Two leave no room for a wrong term.
constexpr double kTolerance = 0.02;

TEST_F(RayMotionTest, TwistsMatchFiniteDifferences) {
  for (int i = 0; i < 6; ++i) {
    const auto sums = [&](double by) {
      return tileSums(kCamera, Eigen::Affine3d(updatedPose(pose_, by * Twist::Unit(i), centre())));
    };
    EXPECT_LT(differenceFor(motionByTwist(i, centre()), i < 3 ? 0.05 : 0.0005, sums), kTolerance) << "component " << i;
  }
}

TEST_F(RayMotionTest, FocalLengthMatchesFiniteDifferences) {
  const auto sums = [&](double by) {
    XrayCamera camera = kCamera;
    camera.fx *= std::exp(by);
    camera.fy *= std::exp(by);
    return tileSums(camera, Eigen::Affine3d(pose_));
  };
  EXPECT_LT(differenceFor(motionByFocalLength(), 0.001, sums), kTolerance);
}

TEST_F(RayMotionTest, PrincipalPointMatchesFiniteDifferences) {
  for (int axis = 0; axis < 2; ++axis) {
    const auto sums = [&](double by) {
      XrayCamera camera = kCamera;
      (axis == 0 ? camera.cx : camera.cy) += by;
      return tileSums(camera, Eigen::Affine3d(pose_));
    };
    EXPECT_LT(differenceFor(motionByPrincipalPoint(axis, kCamera), 0.05, sums), kTolerance) << "axis " << axis;
  }
}

TEST_F(RayMotionTest, StrainsMatchFiniteDifferences) {
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      Eigen::Matrix3d strain = Eigen::Matrix3d::Zero();
      strain(i, j) = strain(j, i) = 1.0;
      const auto sums = [&](double by) {
        const Eigen::Vector3d centre_ct = engine_->volume().centreCt();
        const Eigen::Affine3d stretched = Eigen::Translation3d(centre_ct) *
                                          Eigen::Matrix3d(Eigen::Matrix3d::Identity() + by * strain) *
                                          Eigen::Translation3d(-centre_ct);
        return tileSums(kCamera, Eigen::Affine3d(pose_) * stretched);
      };
      EXPECT_LT(differenceFor(motionByStrain(strain, pose_, centre()), 0.0005, sums), kTolerance) << i << ' ' << j;
    }
  }
}

// No camera of the engine has these distortions; but at a place they are a shift of the image, which the principal
// point gives: the derivatives of both, tile by tile.
TEST_F(RayMotionTest, DistortionsAreShiftsOfTheImageThatGrowOutwards) {
  const TileProducts sums = products(kCamera, pose_,
                                     {motionByRadialDistortion(), motionBySwirl(), motionByPrincipalPoint(0, kCamera),
                                      motionByPrincipalPoint(1, kCamera)});
  double radial2 = 0.0, radial_off2 = 0.0, swirl2 = 0.0, swirl_off2 = 0.0;
  for (int ty = 0; ty < sums.tiles_y; ++ty) {
    for (int tx = 0; tx < sums.tiles_x; ++tx) {
      const double x = (tx * 8 + 3.5 - kCamera.cx) / kCamera.fx, y = (ty * 8 + 3.5 - kCamera.cy) / kCamera.fy;
      const double r2 = x * x + y * y;
      // A shift of the principal point by one pixel moves x by −1 / fx.
      const double by_x = -kCamera.fx * sums.tile(tx, ty)[5], by_y = -kCamera.fy * sums.tile(tx, ty)[6];
      radial2 += std::pow(sums.tile(tx, ty)[3], 2);
      radial_off2 += std::pow(sums.tile(tx, ty)[3] - r2 * (x * by_x + y * by_y), 2);
      swirl2 += std::pow(sums.tile(tx, ty)[4], 2);
      swirl_off2 += std::pow(sums.tile(tx, ty)[4] - r2 * (x * by_y - y * by_x), 2);
    }
  }
  // r² and the derivative both change inside a tile of a tenth of the image; a wrong sign or power would be 100 %.
  EXPECT_LT(std::sqrt(radial_off2 / radial2), 0.2);
  EXPECT_LT(std::sqrt(swirl_off2 / swirl2), 0.2);
  EXPECT_GT(swirl2, 0.0);
}

TEST_F(RayMotionTest, WindowsAddUpToTheStepOfThePose) {
  // Beside the optimum, so that gradients are not zero.
  const RigidTransform beside =
      updatedPose(pose_, (Twist() << 0.7, -0.5, 2.0, 0.01, -0.006, 0.008).finished(), centre());
  std::vector<RayMotion> motions;
  for (int i = 0; i < 6; ++i) motions.push_back(motionByTwist(i, beside * engine_->volume().centreCt()));
  for (const int span : {0, 1, 2}) {
    WindowOptions options = windowsFor(Similarity::kLocalNormalised, xray_->deviation());
    options.span = span;
    options.robust_scale2 = 0.3;
    const StepSums step = engine_->evaluate(xray_.get(), 0, 0, {beside}, options).front();
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(6);
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(6, 6);
    double cost = 0.0;
    forEachWindow(products(kCamera, beside, motions), options, [&](const WindowEvidence& window) {
      gradient += window.gradient;
      matrix += window.matrix;
      cost += window.cost;
    });
    // The device adds in float.
    EXPECT_NEAR(cost, step.cost, 1e-3 * step.cost) << "span " << span;
    EXPECT_LT((gradient - step.gradient).norm(), 1e-3 * step.gradient.norm()) << "span " << span;
    EXPECT_LT((matrix - step.matrix).norm(), 1e-3 * step.matrix.norm()) << "span " << span;
  }
}

TEST_F(RayMotionTest, MoreMotionsThanALaunchTakesAreRefused) {
  EXPECT_THROW(products(kCamera, pose_, std::vector<RayMotion>(kMostRayMotions + 1)), std::invalid_argument);
}

}  // namespace
}  // namespace xray_registration
