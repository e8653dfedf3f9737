// A trunk of soft tissue with two "vertebrae" of other shapes that move in it, by the exact projector.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "registration/body_objective.h"
#include "xray_registration/drr/reference_projector.h"
#include "xray_registration/registration/fast_registrar.h"

namespace xray_registration {
namespace {

const XrayCamera kCamera{128, 128, 500.0, 500.0, 63.5, 63.5};
constexpr double kSpacingMm = 2.0;

/// Values by a function of the point (mm, from the middle of the trunk), on a grid that all parts share.
template <typename Value>
AttenuationVolume filled(const Value& value) {
  AttenuationVolume volume;
  volume.grid.size = {64, 48, 72};
  volume.grid.spacing_mm = Eigen::Vector3d::Constant(kSpacingMm);
  volume.grid.origin_ct_mm = -0.5 * kSpacingMm * (volume.grid.size.cast<double>() - Eigen::Vector3d::Ones());
  volume.scale_per_mm = 1e-6F;
  for (int z = 0; z < volume.grid.size.z(); ++z) {
    for (int y = 0; y < volume.grid.size.y(); ++y) {
      for (int x = 0; x < volume.grid.size.x(); ++x) {
        const Eigen::Vector3d p = volume.grid.ctFromIndex() * Eigen::Vector3d(x, y, z);
        volume.values.push_back(static_cast<std::uint16_t>(1e6 * value(p)));
      }
    }
  }
  return volume;
}

/// 1 inside an ellipsoid, 0 outside, a voxel of transition.
double inside(const Eigen::Vector3d& p, const Eigen::Vector3d& centre, const Eigen::Vector3d& radii) {
  const double r = (p - centre).cwiseQuotient(radii).norm();
  return std::clamp((1.0 - r) * radii.mean() / kSpacingMm + 0.5, 0.0, 1.0);
}

/// A block with three processes, so that every turn shows.
double vertebra(const Eigen::Vector3d& p) {
  double value = 0.0;
  value = std::max(value, inside(p, {0, -6, 0}, {17, 12, 10}));
  value = std::max(value, inside(p, {0, 16, -4}, {4, 13, 5}));
  value = std::max(value, inside(p, {20, 6, 3}, {11, 4, 4}));
  value = std::max(value, inside(p, {-20, 5, -2}, {10, 5, 4}));
  return 0.02 * value;
}

double soft(const Eigen::Vector3d& p) {
  const double ribs = 0.012 * (inside(p, {40, 0, 10}, {8, 30, 6}) + inside(p, {-42, 4, -20}, {7, 28, 6}) +
                               inside(p, {36, -6, -40}, {9, 26, 6}));
  return 0.02 * inside(p, {0, 0, 0}, {60, 44, 69}) + ribs;
}

const Eigen::Vector3d kUpper{0.0, 4.0, 22.0};
const Eigen::Vector3d kLower{2.0, 2.0, -22.0};

class MovingBodiesTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    rest_ = filled(soft);
    upper_ = filled([](const Eigen::Vector3d& p) { return vertebra(p - kUpper); });
    lower_ = filled([](const Eigen::Vector3d& p) { return vertebra(p - kLower); });
    const AttenuationVolume whole =
        filled([](const Eigen::Vector3d& p) { return soft(p) + vertebra(p - kUpper) + vertebra(p - kLower); });
    registrar_ = std::make_unique<FastRegistrar>(std::make_shared<Device>(), RegistrarOptions{}, Logger{});
    registrar_->setVolume(whole);
    registrar_->setBodies(rest_, {{"upper", upper_, 0.3, 10.0}, {"lower", lower_, 0.3, 10.0}});
    truth_.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    truth_.linear() = rotationFromVector({0.05, 0.1, -0.05}) * truth_.linear();
    truth_.translation() = Eigen::Vector3d(1.0, -2.0, 700.0);
    T_view_first_ =
        RigidTransform(Eigen::Translation3d(truth_.translation()) * Eigen::AngleAxisd(1.3, Eigen::Vector3d::UnitY()) *
                       Eigen::Translation3d(-truth_.translation()));
  }
  static void TearDownTestSuite() { registrar_.reset(); }
  void SetUp() override { registrar_->forget(); }

  static RigidTransform moved(const Eigen::Vector3d& centre_ct_mm, const Twist& by) {
    return truth_.inverse() * updatedPose(truth_, by, truth_ * centre_ct_mm);
  }

  /// Two views with the bodies moved against the rest.
  static std::vector<ViewInput> views(const RigidTransform& T_ct_upper, const RigidTransform& T_ct_lower) {
    std::vector<ViewInput> inputs;
    for (const RigidTransform& T_view_first : {RigidTransform(RigidTransform::Identity()), T_view_first_}) {
      XrayFrame frame;
      frame.camera = kCamera;
      frame.attenuation = referenceProjection(rest_, T_view_first * truth_, kCamera);
      for (const auto& [body, T_ct_body] : {std::pair(&upper_, T_ct_upper), std::pair(&lower_, T_ct_lower)}) {
        const FloatImage part = referenceProjection(*body, T_view_first * truth_ * T_ct_body, kCamera);
        for (std::size_t i = 0; i < part.pixels.size(); ++i) frame.attenuation.floats().pixels[i] += part.pixels[i];
      }
      inputs.emplace_back(std::make_shared<const XrayFrame>(std::move(frame)), T_view_first);
    }
    return inputs;
  }

  static double errorMm(const BodyResult& body, const RigidTransform& T_ct_body_true) {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-20.0, 20.0}) {
        const Eigen::Vector3d target = body.centre_ct_mm + side * Eigen::Vector3d::Unit(axis);
        sum += (body.T_camera_body * target - truth_ * T_ct_body_true * target).norm() / 6.0;
      }
    }
    return sum;
  }

  static AttenuationVolume rest_, upper_, lower_;
  static std::unique_ptr<FastRegistrar> registrar_;
  static RigidTransform truth_, T_view_first_;
};

AttenuationVolume MovingBodiesTest::rest_, MovingBodiesTest::upper_, MovingBodiesTest::lower_;
std::unique_ptr<FastRegistrar> MovingBodiesTest::registrar_;
RigidTransform MovingBodiesTest::truth_ = RigidTransform::Identity();
RigidTransform MovingBodiesTest::T_view_first_ = RigidTransform::Identity();

const Twist kMotion = (Twist() << 1.5, -1.0, 1.2, 0.03, -0.04, 0.02).finished();

TEST_F(MovingBodiesTest, EachBodyIsFoundWhereItMovedTo) {
  const RigidTransform T_ct_upper = moved(kUpper, kMotion);
  const RigidTransform T_ct_lower = moved(kLower, -kMotion);
  const auto inputs = views(T_ct_upper, T_ct_lower);
  RegistrationResult rest = registrar_->registerFrame(inputs, truth_, false);
  ASSERT_TRUE(rest.accepted) << rest.reason;
  const auto bodies = registrar_->registerBodies({{}, {}}, &rest);
  ASSERT_EQ(bodies.size(), 2U);
  for (const BodyResult& body : bodies) EXPECT_TRUE(body.accepted) << body.name << ": " << body.reason;
  // Voxels of 2 mm, pixels of 1.4 mm at the body: a fifth of a pixel. Unmoved bodies would be 2.2 mm off.
  EXPECT_LT(errorMm(bodies[0], T_ct_upper), 0.3);
  EXPECT_LT(errorMm(bodies[1], T_ct_lower), 0.3);
  EXPECT_GT(errorMm(bodies[0], RigidTransform::Identity()), 1.5);
}

TEST_F(MovingBodiesTest, ATrackedFrameFollowsThem) {
  RegistrationResult rest =
      registrar_->registerFrame(views(moved(kUpper, kMotion), moved(kLower, -kMotion)), truth_, false);
  ASSERT_FALSE(registrar_->registerBodies({{}, {}}, &rest).empty());
  const RigidTransform T_ct_upper = moved(kUpper, 1.4 * kMotion);
  const auto inputs = views(T_ct_upper, moved(kLower, -kMotion));
  rest = registrar_->registerFrame(inputs, truth_, true);
  ASSERT_TRUE(rest.accepted) << rest.reason;
  const auto bodies =
      registrar_->registerBodies({{moved(kUpper, kMotion), true}, {moved(kLower, -kMotion), true}}, &rest);
  EXPECT_TRUE(bodies.at(0).accepted) << bodies.at(0).reason;
  EXPECT_LT(errorMm(bodies.at(0), T_ct_upper), 0.3);
}

TEST_F(MovingBodiesTest, ABodyThatIsNotThereIsRefusedAndTheOtherStands) {
  // Far out of the field in both views.
  const RigidTransform T_ct_gone = moved(kUpper, (Twist() << 400, 400, 0, 0, 0, 0).finished());
  const auto inputs = views(T_ct_gone, moved(kLower, kMotion));
  RegistrationResult rest = registrar_->registerFrame(inputs, truth_, false);
  ASSERT_TRUE(rest.solved);
  rest.accepted = true;  // Whether so much may be missing is another question.
  const auto bodies = registrar_->registerBodies({{}, {}}, &rest);
  EXPECT_FALSE(bodies.at(0).accepted);
  EXPECT_NE(bodies.at(0).reason.find("upper"), std::string::npos) << bodies.at(0).reason;
  EXPECT_TRUE(bodies.at(1).accepted) << bodies.at(1).reason;
}

TEST_F(MovingBodiesTest, FurtherThanItsRangeIsRefused) {
  registrar_->setBodies(rest_, {{"upper", upper_, 0.3, 1.0}, {"lower", lower_, 0.3, 10.0}});
  const auto inputs = views(moved(kUpper, kMotion), RigidTransform::Identity());
  RegistrationResult rest = registrar_->registerFrame(inputs, truth_, false);
  ASSERT_TRUE(rest.accepted) << rest.reason;
  const auto bodies = registrar_->registerBodies({{}, {}}, &rest);
  EXPECT_FALSE(bodies.at(0).accepted);
  EXPECT_NE(bodies.at(0).reason.find("max_translation"), std::string::npos) << bodies.at(0).reason;
  registrar_->setBodies(rest_, {{"upper", upper_, 0.3, 10.0}, {"lower", lower_, 0.3, 10.0}});
}

TEST_F(MovingBodiesTest, WhatOneOfTwoViewsDoesNotShowIsRefused) {
  auto inputs = views(RigidTransform::Identity(), RigidTransform::Identity());
  XrayFrame without = *inputs[1].xray;
  const FloatImage part = referenceProjection(upper_, T_view_first_ * truth_, kCamera);
  for (std::size_t i = 0; i < part.pixels.size(); ++i) without.attenuation.floats().pixels[i] -= part.pixels[i];
  inputs[1].xray = std::make_shared<const XrayFrame>(std::move(without));
  RegistrationResult rest = registrar_->registerFrame(inputs, truth_, false);
  ASSERT_TRUE(rest.accepted) << rest.reason;
  const auto bodies = registrar_->registerBodies({{}, {}}, &rest);
  EXPECT_FALSE(bodies.at(0).accepted);
  EXPECT_NE(bodies.at(0).reason.find("one of the views does not show upper"), std::string::npos) << bodies.at(0).reason;
  EXPECT_TRUE(bodies.at(1).accepted) << bodies.at(1).reason;
}

TEST_F(MovingBodiesTest, TheGradientIsThatOfLikelihoodAndPrior) {
  const auto inputs = views(RigidTransform::Identity(), RigidTransform::Identity());
  const std::unique_ptr<Engine> rest = makeEngineOpenCl(std::make_shared<Device>());
  rest->setVolume(rest_);
  const std::unique_ptr<Engine> body = rest->sibling();
  body->setVolume(upper_);
  DeviceViews all(rest.get());
  all.upload(inputs, truth_, 1e6);
  DeviceViews own(body.get());
  own.shareFrom(all);
  own.surroundBy({{rest.get(), truth_}});
  StepBudget budget(1000);
  const RegistrarOptions options;
  // Ranges so small that the prior is as large as what the X-rays say.
  BodyObjective objective(body.get(), &own, options, &budget, truth_, {"upper", upper_, 0.02, 0.5});
  const Stage stage = bodyStage(0, 1);
  const Eigen::Vector3d centre = truth_ * own.centreCt();
  const RigidTransform pose = updatedPose(truth_, kMotion, centre);
  const auto cost = [&](const RigidTransform& T) { return objective.evaluate(stage, 1.0, {T}).front().cost; };
  const StepSums sums = objective.evaluate(stage, 1.0, {pose}).front();
  for (int i = 0; i < 6; ++i) {
    const double step = i < 3 ? 0.02 : 0.0005;
    const Eigen::Vector3d here = pose * own.centreCt();
    const double finite =
        (cost(updatedPose(pose, step * Twist::Unit(i), here)) - cost(updatedPose(pose, -step * Twist::Unit(i), here))) /
        (2.0 * step);
    // The body is small in windows at its border, and interpolated derivatives jump at voxels' borders: 5 %.
    EXPECT_NEAR(sums.gradient[i], finite, 0.05 * std::abs(finite) + 0.01 * sums.gradient.norm()) << "component " << i;
  }
  EXPECT_LT(cost(truth_), sums.cost);
}

}  // namespace
}  // namespace xray_registration
