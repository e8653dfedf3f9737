#include "xray_registration/registration/geometry_calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

constexpr double kRadPerDeg = 3.14159265358979323846 / 180.0;
constexpr double kDepthMm = 780.0;

/// A head's CT with voxels of 4 mm, and its X-rays by the exact projector from voxels of 2 mm, in three poses, from the
/// side and from a camera 50° away.
class GeometryCalibrationTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    body_ = std::make_unique<AttenuationVolume>(toAttenuation(headPhantom(2.0), {}));
    engine_ = makeEngineOpenCl(std::make_shared<Device>());
    engine_->setVolume(toAttenuation(headPhantom(4.0), {}));
    RigidTransform base = RigidTransform::Identity();
    base.linear() << 0, 1, 0, 0, 0, -1, -1, 0, 0;
    const Eigen::Vector3d centre = engine_->volume().centreCt();
    base.translation() = Eigen::Vector3d(3.0, -5.0, kDepthMm) - base.linear() * centre;
    for (const Eigen::Vector3d& turn :
         {Eigen::Vector3d(0.1, 0.3, -0.05), Eigen::Vector3d(-0.05, 0.2, 0.1), Eigen::Vector3d(0.0, 0.42, 0.03)}) {
      Twist twist;
      twist << 8.0 * turn, turn;
      truth_.push_back(updatedPose(base, twist, base * centre));
    }
    T_second_first_.linear() = rotationFromVector({0.02, 0.87, 0.0});
    T_second_first_.translation() =
        Eigen::Vector3d(-4.0, 6.0, 800.0) - T_second_first_.linear() * Eigen::Vector3d(0.0, 0.0, kDepthMm);
    for (const RigidTransform& pose : truth_) {
      attenuation_.push_back({referenceProjection(*body_, pose, halved(cameras_[0])),
                              referenceProjection(*body_, T_second_first_ * pose, halved(cameras_[1]))});
    }
  }
  static void TearDownTestSuite() {
    engine_.reset();
    body_.reset();
  }

  /// What is told: the truth but for these.
  struct Told {
    double focal_scale = 1.0;
    Eigen::Vector2d centre_shift_px = Eigen::Vector2d::Zero();
    RigidTransform offset = RigidTransform::Identity();  ///< Of the second view's camera, in its own axes.
    double true_radial = 0.0;                            ///< None is told.
    std::size_t views = 2;
    bool fine = false;  ///< Pixels of half the size.
  };

  /// Starts where a registration would end: near the truth.
  static GeometryCalibration calibrated(const Told& told, const CalibrationLimits& limits = {}) {
    std::vector<ViewGeometry> geometry;
    geometry.emplace_back();
    if (told.views > 1) {
      geometry.emplace_back();
      geometry.back().T_view_first = told.offset * T_second_first_;
    }
    const auto make = [&told](std::size_t frame, const std::vector<ViewGeometry>& corrected) {
      std::vector<ViewInput> views;
      for (std::size_t v = 0; v < corrected.size(); ++v) {
        const XrayCamera camera = toldCamera(told, v, corrected[v]);
        XrayFrame xray = straightened(attenuation_[frame][v], cameras_[v], told.fine ? halved(camera) : camera,
                                      corrected[v].radial, told.true_radial);
        views.emplace_back(std::make_shared<const XrayFrame>(std::move(xray)), corrected[v].T_view_first);
      }
      return views;
    };
    return calibrateGeometry(engine_.get(), make, truth_, geometry, limits);
  }

  static XrayCamera toldCamera(const Told& told, std::size_t view, const ViewGeometry& corrected) {
    XrayCamera camera = cameras_[view];
    camera.fx *= told.focal_scale * corrected.focal_scale;
    camera.fy *= told.focal_scale * corrected.focal_scale;
    camera.cx += told.centre_shift_px.x() + corrected.centre_shift_px.x();
    camera.cy += told.centre_shift_px.y() + corrected.centre_shift_px.y();
    return camera;
  }

  /// Of the same field in pixels of half the size, so that interpolation blurs little.
  static XrayCamera halved(XrayCamera camera) {
    return {2 * camera.width, 2 * camera.height,     2.0 * camera.fx,
            2.0 * camera.fy,  2.0 * camera.cx + 0.5, 2.0 * camera.cy + 0.5};
  }

  /// What a lens with true_radial saw of `fine`, straightened as of `camera` with another one.
  static XrayFrame straightened(const FloatImage& fine, const XrayCamera& true_camera, const XrayCamera& camera,
                                double radial, double true_radial) {
    XrayFrame xray;
    xray.camera = camera;
    xray.attenuation = FloatImage(camera.width, camera.height);
    xray.mask = MaskImage(camera.width, camera.height, 255);
    const Eigen::Array2d last(camera.width - 1.0, camera.height - 1.0);
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const Eigen::Vector2d straight = camera.rayDirection(u, v).head<2>();
        const Eigen::Vector2d bent = straight * (1.0 + radial * straight.squaredNorm());
        const Eigen::Vector2d raw_px = camera.project(bent.homogeneous());
        if ((raw_px.array() * (last - raw_px.array())).minCoeff() < 0.0) xray.mask.at(u, v) = 0;
        // The ray that the true lens sent there.
        const Eigen::Vector2d raw = true_camera.rayDirection(raw_px.x(), raw_px.y()).head<2>();
        Eigen::Vector2d ray = raw;
        for (int i = 0; i < 20; ++i) ray = raw / (1.0 + true_radial * ray.squaredNorm());
        xray.attenuation.floats().at(u, v) = interpolated(fine, halved(true_camera).project(ray.homogeneous()));
      }
    }
    return xray;
  }

  /// Bilinear; clamped at the border.
  static float interpolated(const FloatImage& image, const Eigen::Vector2d& at) {
    const double u = std::clamp(at.x(), 0.0, image.width - 1.001);
    const double v = std::clamp(at.y(), 0.0, image.height - 1.001);
    const int x = static_cast<int>(u);
    const int y = static_cast<int>(v);
    const double above = image.at(x, y) + (u - x) * (image.at(x + 1, y) - image.at(x, y));
    const double below = image.at(x, y + 1) + (u - x) * (image.at(x + 1, y + 1) - image.at(x, y + 1));
    return static_cast<float>(above + (v - y) * (below - above));
  }

  static double turnedBy(const RigidTransform& found) {
    return rotationAngleBetween(found, T_second_first_) / kRadPerDeg;
  }
  /// How far the second view sees the CT's centre from where it is.
  static double offAtTheCt(const RigidTransform& found) {
    const Eigen::Vector3d centre = truth_.front() * engine_->volume().centreCt();
    return (found * centre - T_second_first_ * centre).norm();
  }
  static bool names(const std::vector<std::string>& all, const std::string& one) {
    return std::find(all.begin(), all.end(), one) != all.end();
  }
  static double median(const std::vector<ResidualMotion>& all) {
    std::vector<double> lengths;
    for (const ResidualMotion& one : all) lengths.push_back(one.motion_px.norm());
    std::nth_element(lengths.begin(), lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2), lengths.end());
    return lengths[lengths.size() / 2];
  }

  /// Pixels of 2 mm at the head.
  static constexpr XrayCamera cameras_[2] = {{128, 128, 390.0, 390.0, 63.5, 63.5},
                                             {120, 132, 400.0, 400.0, 60.0, 64.0}};
  static std::unique_ptr<AttenuationVolume> body_;
  static std::unique_ptr<Engine> engine_;
  static std::vector<RigidTransform> truth_;
  static RigidTransform T_second_first_;
  static std::vector<std::vector<FloatImage>> attenuation_;
};

constexpr XrayCamera GeometryCalibrationTest::cameras_[2];
std::unique_ptr<AttenuationVolume> GeometryCalibrationTest::body_;
std::unique_ptr<Engine> GeometryCalibrationTest::engine_;
std::vector<RigidTransform> GeometryCalibrationTest::truth_;
RigidTransform GeometryCalibrationTest::T_second_first_ = RigidTransform::Identity();
std::vector<std::vector<FloatImage>> GeometryCalibrationTest::attenuation_;

// Voxels of 4 mm tell the size of the head to a few hundredths of a voxel in 200 mm.
constexpr double kFocal = 0.001;
// A tenth of a pixel of 2 mm across the ray; along it the size in the image decides, as for the focal length.
constexpr double kTranslationMm = 0.8;
constexpr double kRotationDeg = 0.1;

TEST_F(GeometryCalibrationTest, LeavesWhatWasToldRight) {
  const GeometryCalibration found = calibrated({});
  ASSERT_EQ(found.views.size(), 2U);
  for (const CalibratedView& view : found.views) {
    EXPECT_NEAR(view.geometry.focal_scale, 1.0, kFocal);
    EXPECT_LT(view.geometry.centre_shift_px.norm(), 0.5);
    EXPECT_EQ(view.geometry.radial, 0.0);
    EXPECT_GT(view.sigma.focal_scale, 0.0);
    EXPECT_LT(view.sigma.focal_scale, 0.005);
  }
  EXPECT_LT(turnedBy(found.views[1].geometry.T_view_first), kRotationDeg);
  EXPECT_LT(offAtTheCt(found.views[1].geometry.T_view_first), kTranslationMm);
}

TEST_F(GeometryCalibrationTest, FindsTheFocalLength) {
  Told told;
  told.focal_scale = 1.02;
  const GeometryCalibration found = calibrated(told);
  for (const CalibratedView& view : found.views) {
    EXPECT_NEAR(view.geometry.focal_scale * 1.02, 1.0, kFocal);
    EXPECT_FALSE(names(view.undetermined, "focal_length"));
  }
  EXPECT_LT(turnedBy(found.views[1].geometry.T_view_first), kRotationDeg);
  EXPECT_GT(found.similarity_after, found.similarity_before);
  EXPECT_TRUE(found.converged);
  // 2 % of focal length moves the rim of the head by more than half a pixel; what is left is the CT's coarseness.
  EXPECT_GT(median(found.before), 2.0 * median(found.after));
}

TEST_F(GeometryCalibrationTest, FindsThePrincipalPoint) {
  Told told;
  told.centre_shift_px = {6.0, 0.0};
  const GeometryCalibration found = calibrated(told);
  for (const CalibratedView& view : found.views) {
    EXPECT_FALSE(names(view.undetermined, "principal_point"));
    // Two views see it by what it does to the rays' crossing: half a millimetre.
    EXPECT_NEAR(view.geometry.centre_shift_px.x(), -6.0, 0.5);
    EXPECT_NEAR(view.geometry.centre_shift_px.y(), 0.0, 0.5);
  }
}

TEST_F(GeometryCalibrationTest, FindsTheRelativePose) {
  Told told;
  told.offset.linear() = rotationFromVector(kRadPerDeg * Eigen::Vector3d(0.5, -0.6, 0.6).normalized());
  told.offset.translation() = Eigen::Vector3d(1.2, -1.2, 1.0);
  ASSERT_GT(turnedBy(told.offset * T_second_first_), 0.99);
  ASSERT_GT(offAtTheCt(told.offset * T_second_first_), 5.0);
  const GeometryCalibration found = calibrated(told);
  EXPECT_LT(turnedBy(found.views[1].geometry.T_view_first), kRotationDeg);
  EXPECT_LT(offAtTheCt(found.views[1].geometry.T_view_first), kTranslationMm);
  // A principal point would do nearly the same, and pixels of 2 mm hardly tell.
  EXPECT_TRUE(names(found.views[1].undetermined, "principal_point"));
  EXPECT_TRUE(names(found.views[1].undetermined, "view_pose"));
  EXPECT_GT(found.views[1].sigma.rotation_rad, 0.0);
  EXPECT_GT(found.views[1].sigma.source_mm, found.views[1].sigma.translation_mm);
  EXPECT_NEAR(found.views[0].geometry.focal_scale, 1.0, kFocal);
  EXPECT_TRUE(found.views[0].geometry.T_view_first.isApprox(RigidTransform::Identity(), 1e-12));
}

TEST_F(GeometryCalibrationTest, NamesWhatOneViewCannotTell) {
  Told told;
  told.views = 1;
  told.centre_shift_px = {6.0, 0.0};
  CalibrationLimits limits;
  limits.centre_px = 0.01;  // A principal point hides behind a turn about the source but for its perspective.
  const GeometryCalibration found = calibrated(told, limits);
  ASSERT_EQ(found.views.size(), 1U);
  EXPECT_TRUE(names(found.views[0].undetermined, "principal_point"));
  EXPECT_EQ(found.views[0].geometry.centre_shift_px, Eigen::Vector2d::Zero().eval()) << "held at what was told";
  EXPECT_FALSE(names(found.views[0].undetermined, "view_pose")) << "the first view has none";
}

TEST_F(GeometryCalibrationTest, HoldsWhatIsKnownWorseThanItHasToBe) {
  Told told;
  told.focal_scale = 1.02;
  CalibrationLimits limits;
  limits.focal_scale = 1e-7;  // No image tells that.
  const GeometryCalibration found = calibrated(told, limits);
  for (const CalibratedView& view : found.views) {
    EXPECT_TRUE(names(view.undetermined, "focal_length"));
    EXPECT_EQ(view.geometry.focal_scale, 1.0) << "held at what was told";
    EXPECT_GT(view.sigma.focal_scale, limits.focal_scale) << "what the X-rays leave open";
  }
}

TEST_F(GeometryCalibrationTest, FindsAContradictedRelativePoseEvenWhereItIsNotDetermined) {
  Told told;
  told.offset.linear() = rotationFromVector(kRadPerDeg * Eigen::Vector3d(0.5, -0.6, 0.6).normalized());
  CalibrationLimits limits;
  limits.translation_mm = 1e-4;
  const GeometryCalibration found = calibrated(told, limits);
  EXPECT_TRUE(names(found.views[1].undetermined, "view_pose"));
  EXPECT_GT(found.views[1].sigma.translation_mm, limits.translation_mm);
  EXPECT_LT(turnedBy(found.views[1].geometry.T_view_first), kRotationDeg) << "holding it would put it elsewhere";
}

TEST_F(GeometryCalibrationTest, WhatHangsOnAnUndeterminedPrincipalPointIsNotDeterminedEither) {
  Told told;
  told.offset.linear() = rotationFromVector(kRadPerDeg * Eigen::Vector3d(0.5, -0.6, 0.6).normalized());
  CalibrationLimits limits;
  limits.focal_scale = 0.05;
  const GeometryCalibration open = calibrated(told, limits);
  ASSERT_TRUE(names(open.views[1].undetermined, "principal_point"));
  EXPECT_TRUE(names(open.views[1].undetermined, "view_pose"));
  limits.centre_px = 30.0;
  const GeometryCalibration seen = calibrated(told, limits);
  ASSERT_FALSE(names(seen.views[1].undetermined, "principal_point"));
  EXPECT_FALSE(names(seen.views[1].undetermined, "view_pose"));
  EXPECT_GT(open.views[1].sigma.source_mm, 1.5 * seen.views[1].sigma.source_mm);
}

TEST_F(GeometryCalibrationTest, PixelsFinerThanTheCtMakeNothingMoreCertain) {
  Told told;
  told.focal_scale = 1.02;
  const GeometryCalibration coarse = calibrated(told);
  told.fine = true;
  const GeometryCalibration fine = calibrated(told);
  for (std::size_t v = 0; v < 2; ++v) {
    EXPECT_GT(fine.views[v].sigma.focal_scale, 0.8 * coarse.views[v].sigma.focal_scale);
    EXPECT_LT(std::abs(1.02 * fine.views[v].geometry.focal_scale - 1.0), 3.0 * fine.views[v].sigma.focal_scale);
  }
}

TEST_F(GeometryCalibrationTest, FindsRadialDistortion) {
  // Two pixels at half the width.
  const double half = 0.5 * cameras_[0].width;
  const double k1 = 2.0 / half / std::pow(half / cameras_[0].fx, 2.0);
  Told told;
  told.true_radial = k1;
  const GeometryCalibration found = calibrated(told);
  for (const CalibratedView& view : found.views) {
    EXPECT_NEAR(view.geometry.radial, k1, 0.25 * k1);
    EXPECT_GT(view.sigma.radial, 0.0);
    EXPECT_FALSE(names(view.undetermined, "distortion"));
    // Focal length and distortion share what the other lacks; together they bend as the lens does to 0.3 px of 2.
    const double radius = half / cameras_[0].fx;
    const double off = view.geometry.focal_scale - 1.0 + (view.geometry.radial - k1) * radius * radius;
    EXPECT_LT(std::abs(half * off), 0.3);
  }
  // Likeness cannot be compared: straightening blurs. What bent is straight.
  EXPECT_LT(median(found.after), 0.25 * median(found.before));
}

TEST_F(GeometryCalibrationTest, RefusesToCalibrateFromNothing) {
  const auto none = [](std::size_t, const std::vector<ViewGeometry>&) { return std::vector<ViewInput>(); };
  EXPECT_THROW(calibrateGeometry(engine_.get(), none, {}, std::vector<ViewGeometry>(1)), std::invalid_argument);
  EXPECT_THROW(calibrateGeometry(engine_.get(), none, truth_, {}), std::invalid_argument);
}

}  // namespace
}  // namespace xray_registration
