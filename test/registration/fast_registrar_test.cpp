#include "xray_registration/registration/fast_registrar.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/evaluation/xray_simulator.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

constexpr double kDepthMm = 780.0;
/// Pixels of 2 mm at the head, which fills most of the image.
const XrayCamera kCamera{128, 128, 390.0, 390.0, 63.5, 63.5};

/// The slices from `first` to `last` of a CT, as a scanner with a shorter range would give them.
Volume slices(const Volume& whole, int first, int last) {
  Volume part;
  part.grid = whole.grid;
  part.grid.size.z() = last - first + 1;
  part.grid.origin_ct_mm = whole.grid.ctFromIndex() * Eigen::Vector3d(0, 0, first);
  const std::size_t slice =
      static_cast<std::size_t>(whole.grid.size.x()) * static_cast<std::size_t>(whole.grid.size.y());
  part.hu.assign(whole.hu.begin() + static_cast<std::ptrdiff_t>(slice) * first,
                 whole.hu.begin() + static_cast<std::ptrdiff_t>(slice) * (last + 1));
  return part;
}

RegistrarOptions withAccept(AcceptOptions accept) {
  RegistrarOptions options;
  options.accept = accept;
  return options;
}

/// Calibration left nothing open: the covariance is that of the images alone.
RegistrarOptions withExactSetup() {
  RegistrarOptions options;
  options.setup = {0.0, 0.0, 0.0, 0.0, 0.0};
  return options;
}

/// A head's CT with voxels of 4 mm and its X-rays by the exact projector from voxels of 2 mm, from the side.
class FastRegistrarTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    body_ = std::make_unique<AttenuationVolume>(toAttenuation(headPhantom(2.0), {}));
    ct_ = std::make_unique<AttenuationVolume>(toAttenuation(headPhantom(4.0), {}));
    device_ = std::make_shared<Device>();
    registrar_ = std::make_unique<FastRegistrar>(device_, RegistrarOptions{}, Logger{});
    registrar_->setVolume(*ct_);
    truth_.linear() << 0, 1, 0, 0, 0, -1, -1, 0, 0;
    truth_.linear() = rotationFromVector({0.1, 0.3, -0.05}) * truth_.linear();
    truth_.translation() = Eigen::Vector3d(3.0, -5.0, kDepthMm) - truth_.linear() * registrar_->centreCt();
    view_ = std::make_unique<XrayFrame>();
    view_->camera = kCamera;
    view_->attenuation = referenceProjection(*body_, truth_, kCamera);
  }
  static void TearDownTestSuite() {
    registrar_.reset();
    device_.reset();
    body_.reset();
    ct_.reset();
    view_.reset();
  }
  void SetUp() override { ASSERT_TRUE(registrar_->setOptions({})); }

  static Twist twist(double x, double y, double z, double rx, double ry, double rz) {
    Twist result;
    result << x, y, z, rx, ry, rz;
    return result;
  }
  static RigidTransform off(const Twist& motion) {
    return updatedPose(truth_, motion, truth_ * registrar_->centreCt());
  }
  /// 5 degrees and 8 mm.
  static RigidTransform coldStart() { return off(twist(5.0, -4.8, 4.0, 0.05, -0.055, 0.045)); }
  /// What a patient's breath does between two frames.
  static RigidTransform nearStart() { return off(twist(1.0, -0.7, 1.5, 0.008, -0.006, 0.01)); }

  static PoseError errorOf(const RegistrationResult& result) {
    return poseError(result.T_camera_ct, truth_, targetGrid(registrar_->centreCt(), 100.0));
  }

  static void expectFinite(const RegistrationResult& result) {
    EXPECT_TRUE(result.T_camera_ct.matrix().allFinite());
    EXPECT_TRUE(isRigid(result.T_camera_ct.matrix(), 1e-6));
    EXPECT_TRUE(result.covariance.allFinite());
    for (const double number : {result.similarity, result.residual, result.inlier_fraction, result.condition_number}) {
      EXPECT_TRUE(std::isfinite(number));
    }
    EXPECT_EQ(result.accepted, result.reason.empty()) << result.reason;
  }

  static void expectFound(const RegistrationResult& result, double inplane_mm, double mtre_mm) {
    expectFinite(result);
    EXPECT_TRUE(result.accepted) << result.reason;
    EXPECT_TRUE(result.converged);
    const PoseError error = errorOf(result);
    EXPECT_LT(error.inplane_mm, inplane_mm);
    EXPECT_LT(error.mtre_mm, mtre_mm);
  }

  static void expectRefused(const RegistrationResult& result, const std::string& word) {
    expectFinite(result);
    EXPECT_FALSE(result.accepted);
    EXPECT_NE(result.reason.find(word), std::string::npos) << result.reason;
  }

  static XrayFrame viewOf(const FloatImage& attenuation) {
    XrayFrame view = *view_;
    view.attenuation = attenuation;
    return view;
  }

  /// The same head from a camera a quarter turn about its long axis away.
  static ViewInput secondView() {
    const Eigen::Vector3d centre = truth_ * registrar_->centreCt();
    RigidTransform T_view_first = RigidTransform::Identity();
    T_view_first.linear() = rotationFromVector({0.05, 1.5, 0.0});
    T_view_first.translation() = Eigen::Vector3d(-4.0, 6.0, 800.0) - T_view_first.linear() * centre;
    XrayFrame xray;
    xray.camera = {120, 132, 400.0, 395.0, 60.0, 64.0};
    xray.attenuation = referenceProjection(*body_, T_view_first * truth_, xray.camera);
    return ViewInput(std::make_shared<const XrayFrame>(std::move(xray)), T_view_first);
  }

  static std::unique_ptr<AttenuationVolume> body_;
  static std::unique_ptr<AttenuationVolume> ct_;
  static std::shared_ptr<Device> device_;
  static std::unique_ptr<FastRegistrar> registrar_;
  static std::unique_ptr<XrayFrame> view_;
  static RigidTransform truth_;
};

std::unique_ptr<AttenuationVolume> FastRegistrarTest::body_;
std::unique_ptr<AttenuationVolume> FastRegistrarTest::ct_;
std::shared_ptr<Device> FastRegistrarTest::device_;
std::unique_ptr<FastRegistrar> FastRegistrarTest::registrar_;
std::unique_ptr<XrayFrame> FastRegistrarTest::view_;
RigidTransform FastRegistrarTest::truth_ = RigidTransform::Identity();

// A tenth of a pixel of 2 mm: CT and X-ray come from voxels of different size, so the truth itself is only known to a
// small part of the 4 mm voxel.
constexpr double kInPlaneMm = 0.2;
// One view sees depth by the change in size alone: 1 mm of depth moves the head's outline by an eighth of a
// millimetre.
constexpr double kOneViewMm = 3.0;

TEST_F(FastRegistrarTest, FindsTheHeadFromAColdStart) {
  ASSERT_GT(poseError(coldStart(), truth_, targetGrid(registrar_->centreCt(), 100.0)).mtre_mm, 8.0);
  expectFound(registrar_->registerFrame({*view_}, coldStart(), false), kInPlaneMm, kOneViewMm);
}

TEST_F(FastRegistrarTest, FindsTheHeadFromEverySide) {
  const Twist motion = twist(5.0, -4.8, 4.0, 0.05, -0.055, 0.045);
  for (int sign = 0; sign < 4; ++sign) {
    Twist turned = motion;
    turned.head<2>() = Eigen::Rotation2Dd(1.57 * sign) * motion.head<2>();
    turned.tail<3>() = Eigen::AngleAxisd(1.57 * sign, Eigen::Vector3d(1, -1, 0.5).normalized()) * motion.tail<3>();
    expectFound(registrar_->registerFrame({*view_}, off(turned), false), kInPlaneMm, kOneViewMm);
  }
}

TEST_F(FastRegistrarTest, TracksFromANearStart) {
  ASSERT_TRUE(registrar_->registerFrame({*view_}, coldStart(), false).accepted);
  const RegistrationResult tracked = registrar_->registerFrame({*view_}, nearStart(), true);
  expectFound(tracked, kInPlaneMm, kOneViewMm);
  EXPECT_LT(tracked.iterations, 15);
}

TEST_F(FastRegistrarTest, TracksWithoutAColdStartBefore) {
  FastRegistrar fresh(device_, {}, {});
  fresh.setVolume(*ct_);
  expectFound(fresh.registerFrame({*view_}, nearStart(), true), kInPlaneMm, kOneViewMm);
}

TEST_F(FastRegistrarTest, ASecondViewResolvesDepth) {
  ASSERT_TRUE(registrar_->setOptions(withExactSetup()));
  const RegistrationResult one = registrar_->registerFrame({*view_}, coldStart(), false);
  const RegistrationResult two = registrar_->registerFrame({*view_, secondView()}, coldStart(), false);
  // In all three directions as good as one view is in two.
  expectFound(two, kInPlaneMm, 0.7);
  // One view: depth is the weak direction, by about the ratio of depth to radius, 780 : 100, squared for variances.
  EXPECT_GT(one.covariance(2, 2), 9.0 * one.covariance(0, 0));
  EXPECT_GT(one.covariance(2, 2), 9.0 * one.covariance(1, 1));
  EXPECT_LT(two.covariance(2, 2), 4.0 * two.covariance(0, 0));
  EXPECT_LT(two.covariance(2, 2), 0.2 * one.covariance(2, 2));
  EXPECT_LT(two.condition_number, one.condition_number);
}

TEST_F(FastRegistrarTest, TracksTwoViews) {
  const std::vector<ViewInput> views = {*view_, secondView()};
  ASSERT_TRUE(registrar_->registerFrame(views, coldStart(), false).accepted);
  expectFound(registrar_->registerFrame(views, nearStart(), true), kInPlaneMm, 0.7);
}

TEST_F(FastRegistrarTest, CovarianceIsACovariance) {
  ASSERT_TRUE(registrar_->setOptions(withExactSetup()));
  for (const bool two_views : {false, true}) {
    std::vector<ViewInput> views = {*view_};
    if (two_views) views.push_back(secondView());
    const RegistrationResult result = registrar_->registerFrame(views, coldStart(), false);
    ASSERT_TRUE(result.accepted) << result.reason;
    EXPECT_TRUE(result.covariance.allFinite());
    EXPECT_TRUE(result.covariance.isApprox(result.covariance.transpose(), 1e-9));
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(result.covariance).eigenvalues().minCoeff(), 0.0);
    EXPECT_GE(result.condition_number, 1.0);
    EXPECT_LT(result.condition_number, 1e6);
    // Of the order of the error: not metres, not nanometres.
    EXPECT_LT(std::sqrt(result.covariance(0, 0)), 2.0);
    EXPECT_GT(std::sqrt(result.covariance(0, 0)), 1e-4);
  }
}

TEST_F(FastRegistrarTest, GainAndOffsetDoNotMatter) {
  FloatImage changed = view_->attenuation.values();
  for (float& pixel : changed.pixels) pixel = 0.45F * pixel + 1.7F;
  const RegistrationResult plain = registrar_->registerFrame({*view_}, coldStart(), false);
  const RegistrationResult result = registrar_->registerFrame({viewOf(changed)}, coldStart(), false);
  expectFound(result, kInPlaneMm, kOneViewMm);
  // The same windows, the same correlations; flat ones differ by their epsilon, and the solver stops a little earlier
  // or later.
  EXPECT_NEAR(result.similarity, plain.similarity, 0.01);
  EXPECT_LT(poseError(result.T_camera_ct, plain.T_camera_ct, targetGrid(registrar_->centreCt(), 100.0)).inplane_mm,
            0.1);
}

TEST_F(FastRegistrarTest, GammaDoesNotMatter) {
  // Display images: grey values bent by a gamma.
  FloatImage bent = view_->attenuation.values();
  for (float& pixel : bent.pixels) pixel = 3.0F * std::pow(std::max(pixel, 0.0F) / 5.0F, 0.6F);
  // The outline's slopes are bent as well, and depth is read from them.
  expectFound(registrar_->registerFrame({viewOf(bent)}, coldStart(), false), 2.0 * kInPlaneMm, 3.0 * kOneViewMm);
}

TEST_F(FastRegistrarTest, AnOccludingRodDoesNotMatter) {
  std::mt19937_64 random(3);
  XrayPhysics physics;
  Instrument rod;
  rod.a_camera_mm = {-60.0, -70.0, 600.0};
  rod.b_camera_mm = {30.0, 90.0, 620.0};
  rod.radius_mm = 4.0;
  physics.instruments.push_back(rod);
  physics.scatter_sigma_px = 10.0;
  const Image<std::uint16_t> detector = simulateXray(*body_, truth_, kCamera, physics, &random);
  FloatImage attenuation(kCamera.width, kCamera.height);
  for (std::size_t i = 0; i < attenuation.pixels.size(); ++i) {
    attenuation.pixels[i] = -std::log(std::max<float>(detector.pixels[i], 1.0F) / 48000.0F);
  }
  const RegistrationResult result = registrar_->registerFrame({viewOf(attenuation)}, coldStart(), false);
  // Noise, scatter and metal: a quarter of a pixel.
  expectFound(result, 0.5, 5.0);
  const RegistrationResult clean = registrar_->registerFrame({*view_}, coldStart(), false);
  EXPECT_LT(result.similarity, clean.similarity);
}

TEST_F(FastRegistrarTest, MaskedPixelsHaveNoSay) {
  XrayFrame view = *view_;
  view.mask = MaskImage(128, 128, 255);
  FloatImage other = view.attenuation.values();
  for (int v = 30; v < 75; ++v) {
    for (int u = 60; u < 100; ++u) {
      view.mask.at(u, v) = 0;
      view.attenuation.floats().at(u, v) = 9.0F;
      other.at(u, v) = u % 7 == 0 ? -5.0F : 2.0F;
    }
  }
  const RegistrationResult result = registrar_->registerFrame({view}, coldStart(), false);
  expectFound(result, kInPlaneMm, kOneViewMm);
  view.attenuation = other;
  const RegistrationResult again = registrar_->registerFrame({view}, coldStart(), false);
  EXPECT_EQ(result.T_camera_ct.matrix(), again.T_camera_ct.matrix());  // To the bit.

  view.mask = MaskImage(128, 128, 0);
  expectRefused(registrar_->registerFrame({view}, coldStart(), false), "");
}

TEST_F(FastRegistrarTest, GainOffsetSimilarityFindsItToo) {
  RegistrarOptions options;
  options.similarity = Similarity::kGainOffset;
  ASSERT_TRUE(registrar_->setOptions(options));
  FloatImage changed = view_->attenuation.values();
  for (float& pixel : changed.pixels) pixel = 0.7F * pixel - 0.4F;
  expectFound(registrar_->registerFrame({viewOf(changed)}, coldStart(), false), kInPlaneMm, kOneViewMm);
}

TEST_F(FastRegistrarTest, GradientCorrelationFindsAndTracksItToo) {
  RegistrarOptions options;
  options.similarity = Similarity::kGradientCorrelation;
  ASSERT_TRUE(registrar_->setOptions(options));
  FloatImage changed = view_->attenuation.values();
  for (float& pixel : changed.pixels) pixel = 0.7F * pixel - 0.4F;
  expectFound(registrar_->registerFrame({viewOf(changed)}, coldStart(), false), kInPlaneMm, kOneViewMm);
  expectFound(registrar_->registerFrame({viewOf(changed)}, nearStart(), true), kInPlaneMm, kOneViewMm);
}

TEST_F(FastRegistrarTest, WithoutSearchOrRobustWeightsANearStartIsFound) {
  RegistrarOptions options;
  options.search = false;
  options.robust_weights = false;
  ASSERT_TRUE(registrar_->setOptions(options));
  expectFound(registrar_->registerFrame({*view_}, nearStart(), false), kInPlaneMm, kOneViewMm);
}

TEST_F(FastRegistrarTest, BinnedImagesAreFoundToo) {
  RegistrarOptions options;
  options.max_image_pixels = 3000;
  ASSERT_TRUE(registrar_->setOptions(options));
  // Pixels of 4 mm and more: a tenth of one again.
  expectFound(registrar_->registerFrame({*view_}, coldStart(), false), 2.0 * kInPlaneMm, 2.0 * kOneViewMm);
}

TEST_F(FastRegistrarTest, ACtThatEndsBeforeTheBodyDoes) {
  const Volume whole = headPhantom(4.0);
  const int n = whole.grid.size.z();
  const AttenuationVolume part = toAttenuation(slices(whole, n / 3, n * 5 / 6), {});
  ASSERT_TRUE(part.face_is_cut[4]);
  ASSERT_TRUE(part.face_is_cut[5]);
  const auto inplane = [&](bool weights) {
    RegistrarOptions options;
    options.truncation_weights = weights;
    FastRegistrar registrar(device_, options, {});
    registrar.setVolume(part);
    const RegistrationResult result = registrar.registerFrame({*view_}, coldStart(), false);
    expectFinite(result);
    EXPECT_TRUE(result.accepted || !weights) << result.reason;
    return poseError(result.T_camera_ct, truth_, targetGrid(registrar.centreCt(), 80.0)).inplane_mm;
  };
  // A fifth of a pixel of 2 mm: the cut itself is a voxel of 4 mm thick. Without weights the edge of the cut is matched
  // to whatever edge there is, tens of millimetres away (46 mm measured).
  EXPECT_LT(inplane(true), 0.4);
  EXPECT_GT(inplane(false), 4.0);
}

TEST_F(FastRegistrarTest, ACutSpecimenIsFoundAsWhole) {
  const Volume whole = headPhantom(4.0);
  const int n = whole.grid.size.z();
  const AttenuationVolume part = toAttenuation(slices(whole, n / 3, n * 5 / 6), {});
  FastRegistrar registrar(device_, {}, {});
  registrar.setVolume(part);
  const RegistrationResult result =
      registrar.registerFrame({viewOf(referenceProjection(part, truth_, kCamera))}, coldStart(), false);
  expectFinite(result);
  EXPECT_TRUE(result.accepted) << result.reason;
  EXPECT_LT(poseError(result.T_camera_ct, truth_, targetGrid(registrar.centreCt(), 80.0)).inplane_mm, kInPlaneMm);
}

TEST_F(FastRegistrarTest, AnotherObjectIsRefused) {
  const AttenuationVolume pelvis = toAttenuation(pelvisPhantom(4.0), {});
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  pose.translation() = Eigen::Vector3d(0, 0, kDepthMm) - pose.linear() * anatomicalCentreCt(pelvis);
  expectRefused(registrar_->registerFrame({viewOf(referenceProjection(pelvis, pose, kCamera))}, coldStart(), false),
                "");
  ASSERT_TRUE(registrar_->registerFrame({*view_}, coldStart(), false).accepted);
  expectRefused(registrar_->registerFrame({viewOf(referenceProjection(pelvis, pose, kCamera))}, nearStart(), true), "");
}

TEST_F(FastRegistrarTest, TheSameHeadUpsideDownIsRefused) {
  FloatImage turned = view_->attenuation.values();
  std::reverse(turned.pixels.begin(), turned.pixels.end());
  expectRefused(registrar_->registerFrame({viewOf(turned)}, coldStart(), false), "");
}

TEST_F(FastRegistrarTest, NoiseIsRefused) {
  std::mt19937 random(11);
  std::normal_distribution<float> normal(2.0F, 0.5F);
  FloatImage noise(kCamera.width, kCamera.height);
  for (float& pixel : noise.pixels) pixel = normal(random);
  expectRefused(registrar_->registerFrame({viewOf(noise)}, coldStart(), false), "similarity");
  expectRefused(registrar_->registerFrame({viewOf(noise)}, nearStart(), true), "similarity");
}

TEST_F(FastRegistrarTest, AnEmptyImageIsRefused) {
  for (const float value : {0.0F, 3.0F, -1e6F}) {
    expectRefused(registrar_->registerFrame({viewOf(FloatImage(128, 128, value))}, coldStart(), false), "");
    expectRefused(registrar_->registerFrame({viewOf(FloatImage(128, 128, value))}, nearStart(), true), "");
  }
}

TEST_F(FastRegistrarTest, ExtremeValuesGiveNoNan) {
  for (const float scale : {1e-20F, 1e15F, 1e30F}) {
    FloatImage scaled = view_->attenuation.values();
    for (float& pixel : scaled.pixels) pixel *= scale;
    expectFinite(registrar_->registerFrame({viewOf(scaled)}, coldStart(), false));
  }
  FloatImage spike = view_->attenuation.values();
  spike.at(64, 64) = std::numeric_limits<float>::max();
  expectFinite(registrar_->registerFrame({viewOf(spike)}, coldStart(), false));
}

TEST_F(FastRegistrarTest, WrongInputIsRefusedWithAReason) {
  XrayFrame view = *view_;
  view.attenuation.floats().pixels[777] = std::nanf("");
  expectRefused(registrar_->registerFrame({view}, coldStart(), false), "not finite");
  view = *view_;
  view.camera.width = 127;
  expectRefused(registrar_->registerFrame({view}, coldStart(), false), "size");
  view = *view_;
  view.mask = MaskImage(128, 127, 255);
  expectRefused(registrar_->registerFrame({view}, coldStart(), false), "mask");
  view = *view_;
  view.camera.fx = 0.0;
  expectRefused(registrar_->registerFrame({view}, coldStart(), false), "focal");
  expectRefused(registrar_->registerFrame({}, coldStart(), false), "view");
  // The second of two views is looked at as well.
  view = *view_;
  view.attenuation.floats().pixels[5] = std::numeric_limits<float>::infinity();
  expectRefused(registrar_->registerFrame({*view_, view}, coldStart(), false), "not finite");
}

TEST_F(FastRegistrarTest, WrongStartsAreRefusedWithAReason) {
  for (const bool tracking : {false, true}) {
    RigidTransform behind = coldStart();
    behind.translation().z() -= 2000.0;
    expectRefused(registrar_->registerFrame({*view_}, behind, tracking), "behind");
    RigidTransform outside = coldStart();
    outside.translation().x() += 3000.0;
    expectRefused(registrar_->registerFrame({*view_}, outside, tracking), "left the image");
    RigidTransform broken = coldStart();
    broken.translation().y() = std::nan("");
    const RegistrationResult result = registrar_->registerFrame({*view_}, broken, tracking);
    EXPECT_FALSE(result.accepted);
    EXPECT_NE(result.reason.find("start pose"), std::string::npos) << result.reason;
  }
}

TEST_F(FastRegistrarTest, AStartAroundTheSourceIsRefused) {
  XrayFrame view = *view_;
  view.camera = {400, 400, 1200.0, 1200.0, 199.5, 199.5};
  view.attenuation = FloatImage(400, 400, 1.0F);
  for (const double depth_mm : {0.5, 20.0, 100.0}) {
    RigidTransform start = coldStart();
    start.translation().z() -= (start * registrar_->centreCt()).z() - depth_mm;
    expectRefused(registrar_->registerFrame({view}, start, false), "");
    expectRefused(registrar_->registerFrame({view}, start, true), "");
  }
}

TEST_F(FastRegistrarTest, WithoutACtEveryFrameIsRefused) {
  FastRegistrar fresh(device_, {}, {});
  EXPECT_FALSE(fresh.hasVolume());
  EXPECT_EQ(fresh.deviceBytes(), 0U);
  expectRefused(fresh.registerFrame({*view_}, coldStart(), false), "no CT");
}

TEST_F(FastRegistrarTest, TinyImagesAreRefusedWithoutHarm) {
  ASSERT_TRUE(registrar_->registerFrame({*view_}, coldStart(), false).accepted);
  for (const int side : {1, 3, 9, 40}) {
    XrayFrame view;
    view.camera = {side, side, 3.0 * side, 3.0 * side, 0.5 * (side - 1), 0.5 * (side - 1)};
    view.attenuation = FloatImage(side, side, 0.5F);
    expectRefused(registrar_->registerFrame({view}, nearStart(), true), "");
    expectRefused(registrar_->registerFrame({view}, coldStart(), false), "");
  }
}

TEST_F(FastRegistrarTest, AnImageThatShrinksWhileTrackedIsStillFound) {
  ASSERT_TRUE(registrar_->registerFrame({*view_}, coldStart(), false).accepted);
  // The tracked X-ray has one level only.
  XrayFrame view = *view_;
  view.camera = {52, 52, 155.0, 155.0, 25.5, 25.5};
  view.attenuation = referenceProjection(*body_, truth_, view.camera, 2);
  const RegistrationResult result = registrar_->registerFrame({view}, nearStart(), true);
  expectFinite(result);
  // Pixels of 5 mm: a fifth of one.
  EXPECT_LT(errorOf(result).inplane_mm, 1.0);
}

TEST_F(FastRegistrarTest, EqualInputGivesEqualBits) {
  const RegistrationResult first = registrar_->registerFrame({*view_}, coldStart(), false);
  registrar_->renderDrr({50, 40, 200.0, 200.0, 24.5, 19.5}, truth_);
  const RegistrationResult second = registrar_->registerFrame({*view_}, coldStart(), false);
  EXPECT_EQ(first.T_camera_ct.matrix(), second.T_camera_ct.matrix());
  EXPECT_EQ(first.covariance, second.covariance);
  EXPECT_EQ(first.similarity, second.similarity);
  EXPECT_EQ(first.iterations, second.iterations);
  // Nor does it depend on what was registered before: another registrar, which has seen nothing.
  FastRegistrar fresh(device_, {}, {});
  fresh.setVolume(*ct_);
  EXPECT_EQ(fresh.registerFrame({*view_}, coldStart(), false).T_camera_ct.matrix(), first.T_camera_ct.matrix());
}

TEST_F(FastRegistrarTest, ThresholdsRuleTheVerdict) {
  AcceptOptions accept;
  accept.min_similarity = 0.9999;
  ASSERT_TRUE(registrar_->setOptions(withAccept(accept)));
  expectRefused(registrar_->registerFrame({*view_}, coldStart(), false), "similarity");
  accept = {};
  accept.max_condition_number = 1.5;
  ASSERT_TRUE(registrar_->setOptions(withAccept(accept)));
  expectRefused(registrar_->registerFrame({*view_}, coldStart(), false), "condition number");
  accept = {};
  ASSERT_TRUE(registrar_->setOptions(withAccept(accept)));
  ASSERT_TRUE(registrar_->registerFrame({*view_}, coldStart(), false).accepted);
  accept.max_jump_mm = 0.3;
  ASSERT_TRUE(registrar_->setOptions(withAccept(accept)));
  expectRefused(registrar_->registerFrame({*view_}, nearStart(), true), "jumped");
  EXPECT_TRUE(registrar_->registerFrame({*view_}, coldStart(), false).accepted);  // A cold start may move.
}

TEST_F(FastRegistrarTest, AnotherMethodNeedsAnotherRegistrar) {
  RegistrarOptions options;
  options.method = Method::kPaper;
  EXPECT_FALSE(registrar_->setOptions(options));
  EXPECT_TRUE(registrar_->setOptions({}));
}

TEST_F(FastRegistrarTest, TheStepBudgetBoundsAllWorkOfAFrame) {
  const int enough = registrar_->registerFrame({*view_}, coldStart(), false).iterations;
  ASSERT_GT(enough, 4);
  RegistrarOptions options;
  for (const bool search : {false, true}) {
    for (const int budget : {1, 2, enough - 1}) {
      options.search = search;
      options.max_steps_per_frame = budget;
      ASSERT_TRUE(registrar_->setOptions(options));
      const RegistrationResult result = registrar_->registerFrame({*view_}, coldStart(), false);
      expectFinite(result);
      EXPECT_LE(result.iterations, budget);
      if (budget <= 2) expectRefused(result, "max_steps_per_frame");
    }
  }
  options.max_steps_per_frame = enough;
  ASSERT_TRUE(registrar_->setOptions(options));
  EXPECT_TRUE(registrar_->registerFrame({*view_}, coldStart(), false).accepted);
  // A tracked frame draws from it too.
  options.max_steps_per_frame = 1;
  ASSERT_TRUE(registrar_->setOptions({}));
  ASSERT_TRUE(registrar_->registerFrame({*view_}, coldStart(), false).accepted);
  EXPECT_LE(registrar_->registerFrame({*view_}, nearStart(), true).iterations, 10);
}

TEST_F(FastRegistrarTest, ATrackedFrameMakesNoBufferAndEachLevelOnce) {
  ASSERT_TRUE(registrar_->registerFrame({*view_}, nearStart(), false).accepted);
  ASSERT_TRUE(registrar_->registerFrame({*view_}, nearStart(), true).accepted);
  const EngineWork before = registrar_->engine().work();
  const RegistrationResult result = registrar_->registerFrame({*view_}, nearStart(), true);
  const EngineWork after = registrar_->engine().work();
  EXPECT_EQ(after.buffers, before.buffers);
  EXPECT_EQ(after.halvings, before.halvings + 1);  // It uses the two finest levels.
  const std::size_t launches = after.launches - before.launches;
  std::printf("a tracked frame: %zu launches for %d evaluations\n", launches, result.iterations);
  // Three an evaluation (plan, march, windows); besides them the weights, a halving, and what tiles there are on each
  // of two levels.
  EXPECT_LE(launches, 3U * static_cast<std::size_t>(result.iterations) + 5U);
}

TEST_F(FastRegistrarTest, WithoutWhatAColdStartFoundTheNextFrameIsOne) {
  const RegistrationResult cold = registrar_->registerFrame({*view_}, nearStart(), false);
  ASSERT_TRUE(cold.accepted) << cold.reason;
  const auto tracked = [&] { return registrar_->registerFrame({*view_}, nearStart(), true).iterations; };
  const int few = tracked();
  ASSERT_LT(few, cold.iterations);
  registrar_->forget();
  EXPECT_EQ(tracked(), cold.iterations);
  EXPECT_EQ(tracked(), few);
  registrar_->setVolume(*ct_);
  EXPECT_EQ(tracked(), cold.iterations);
  // New thresholds judge what is found; they do not change what a cold start would find out.
  AcceptOptions accept;
  accept.max_jump_mm = 20.0;
  ASSERT_TRUE(registrar_->setOptions(withAccept(accept)));
  EXPECT_EQ(tracked(), few);
  // A cold start that was refused teaches nothing.
  std::mt19937_64 random(4);
  FloatImage noise(kCamera.width, kCamera.height);
  for (float& pixel : noise.pixels) pixel = static_cast<float>(random() % 1000) * 1e-3F;
  ASSERT_FALSE(registrar_->registerFrame({viewOf(noise)}, nearStart(), false).accepted);
  EXPECT_EQ(tracked(), cold.iterations);
}

TEST_F(FastRegistrarTest, TuningThatIsChangedLiveCountsFromTheNextFrame) {
  // A third of the image is covered by something that the CT does not have: robust weights matter.
  FloatImage covered = view_->attenuation.values();
  for (int v = 0; v < 128; ++v) {
    for (int u = 0; u < 40; ++u) covered.at(u, v) += 1.5F * std::sin(0.5F * static_cast<float>(u + v));
  }
  const auto tracked = [&](const RegistrarOptions& options) {
    EXPECT_TRUE(registrar_->setOptions(options));
    return registrar_->registerFrame({viewOf(covered)}, nearStart(), true).T_camera_ct;
  };
  RegistrarOptions without;
  without.robust_weights = false;
  registrar_->forget();
  const RigidTransform robust = tracked({});
  const RigidTransform plain = tracked(without);
  EXPECT_FALSE(robust.isApprox(plain, 1e-9));
  EXPECT_EQ(tracked({}).matrix(), robust.matrix());
}

TEST_F(FastRegistrarTest, RendersInLineIntegrals) {
  const FloatImage drr = registrar_->renderDrr(kCamera, truth_);
  const FloatImage exact = referenceProjection(*ct_, truth_, kCamera);
  double sum2 = 0.0;
  double exact2 = 0.0;
  for (std::size_t i = 0; i < drr.pixels.size(); ++i) {
    sum2 += std::pow(drr.pixels[i] - exact.pixels[i], 2);
    exact2 += std::pow(exact.pixels[i], 2);
  }
  // Interpolated against boxes of 4 mm with hard edges.
  EXPECT_LT(sum2, 0.01 * exact2);
  EXPECT_GT(exact2, 1.0);
}

TEST_F(FastRegistrarTest, TrackedFramesAreLookedAtNoFinerThanTheirCertaintyNeeds) {
  const RigidTransform start = off(twist(0.5, -0.5, 1.0, 0.005, 0.0, -0.005));
  const auto tracked = [&](double precision_mm) {
    RegistrarOptions options;
    options.tracking_precision_mm = precision_mm;
    EXPECT_TRUE(registrar_->setOptions(options));
    registrar_->forget();
    EXPECT_TRUE(registrar_->registerFrame({*view_}, truth_, false).accepted);
    const RegistrationResult result = registrar_->registerFrame({*view_}, start, true);
    EXPECT_TRUE(result.accepted) << result.reason;
    return result;
  };
  const RegistrationResult finest = tracked(0.0);
  const RegistrationResult strict = tracked(1e-4);  // Not to be had, so nothing is spared.
  const RegistrationResult loose = tracked(0.5);
  EXPECT_EQ(finest.T_camera_ct.matrix(), strict.T_camera_ct.matrix());
  EXPECT_NE(finest.T_camera_ct.matrix(), loose.T_camera_ct.matrix());
  EXPECT_LT(poseError(loose.T_camera_ct, truth_, targetGrid(registrar_->centreCt(), 100.0)).inplane_mm, 0.5);
}

}  // namespace
}  // namespace xray_registration
