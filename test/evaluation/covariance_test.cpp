// Is the covariance that comes with a pose true to size? With noise alone between the X-ray and the DRR, the error of
// many registrations, normalised by their covariance, follows a χ² law with as many degrees of freedom as the error
// has.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <random>

#include "xray_registration/drr/device.h"
#include "xray_registration/registration/registrar_factory.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

constexpr int kRegistrations = 60;

/// Normal deviates from the generator's bits (Box and Muller 1958), the same on every platform.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : bits_(seed) {}
  double next() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - unit()));
    return radius * std::cos(2.0 * 3.14159265358979323846 * unit());
  }

 private:
  double unit() { return static_cast<double>(bits_() >> 11U) * 0x1.0p-53; }
  std::mt19937_64 bits_;
};

/// Mean over all registrations of the normalised error squared, divided by its degrees of freedom: 1 when the
/// covariance has the right size.
struct NormalisedError {
  double all = 0.0;
  double inplane = 0.0;  ///< x, y and the turn about z.
  double depth = 0.0;    ///< z alone.
};

NormalisedError meanOf(const std::vector<Twist>& errors, const std::vector<Matrix6d>& covariances) {
  NormalisedError sum;
  const std::vector<int> plane = {0, 1, 5};
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const Twist& error = errors[i];
    const Matrix6d& covariance = covariances[i];
    sum.all += error.dot(covariance.ldlt().solve(error)) / 6.0;
    const Eigen::Vector3d inplane = error(plane);
    const Eigen::Matrix3d inplane_covariance = covariance(plane, plane);
    sum.inplane += inplane.dot(inplane_covariance.ldlt().solve(inplane)) / 3.0;
    sum.depth += error(2) * error(2) / covariance(2, 2);
  }
  const auto count = static_cast<double>(errors.size());
  return {sum.all / count, sum.inplane / count, sum.depth / count};
}

NormalisedError normalisedError(double noise_deviation) {
  const AttenuationVolume volume = toAttenuation(headPhantom(2.5), AttenuationModel{});
  RegistrarOptions options;
  options.setup = {0.0, 0.0, 0.0, 0.0, 0.0};  // Noise alone.
  const auto registrar = makeRegistrar(std::make_shared<Device>(), options, {});
  registrar->setVolume(volume);
  const Eigen::Vector3d centre_ct_mm = registrar->centreCt();

  XrayFrame view;
  view.camera = {128, 128, 600.0, 600.0, 63.5, 63.5};
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  T_camera_ct.linear() = rotationFromVector(Eigen::Vector3d(0.05, 0.1, -0.03)) * T_camera_ct.linear();
  T_camera_ct.translation() = Eigen::Vector3d(4.0, -3.0, 800.0) - T_camera_ct.linear() * centre_ct_mm;
  // The registrar's own picture: nothing but noise is left to explain.
  const FloatImage clean = registrar->renderDrr(view.camera, T_camera_ct);

  Noise noise(11);
  std::vector<Twist> errors;
  std::vector<Matrix6d> covariances;
  for (int i = 0; i < kRegistrations; ++i) {
    view.attenuation = clean;
    for (float& pixel : view.attenuation.floats().pixels) pixel += static_cast<float>(noise_deviation * noise.next());
    const RegistrationResult result = registrar->registerFrame({view}, T_camera_ct, false);
    errors.push_back(twistBetween(T_camera_ct, result.T_camera_ct, T_camera_ct * centre_ct_mm));
    covariances.push_back(result.covariance);
  }
  return meanOf(errors, covariances);
}

void expectTrueToSize(const NormalisedError& error) {
  std::printf("normalised error squared over its expectation: all %.2f, in-plane %.2f, depth %.2f\n", error.all,
              error.inplane, error.depth);
  // 60 registrations: the mean of χ²(6)/6 has a standard deviation of 0.07, of χ²(3)/3 0.11, of χ²(1) 0.18. Three of
  // them above one, and a tenth for the estimate itself, is where the covariance would promise too much. Below, the
  // scatter of overlapping windows is itself an estimate from some hundred windows, good to a tenth or two.
  EXPECT_LT(error.all, 1.35);
  EXPECT_LT(error.inplane, 1.35);
  EXPECT_LT(error.depth, 1.55);
  EXPECT_GT(error.all, 0.7);
  EXPECT_GT(error.inplane, 0.55);
  EXPECT_GT(error.depth, 0.45);
}

/// What calibration left open, drawn at random: the views are seen by their true cameras from their true places, and
/// the registrar is told others.
NormalisedError normalisedErrorOfWrongSetups(std::size_t views) {
  const AttenuationVolume volume = toAttenuation(headPhantom(2.5), AttenuationModel{});
  RegistrarOptions options;
  options.setup = {0.01, 1.0, 0.3, 1.0, 0.0};
  options.accept.max_setup_error_mm = 1000.0;
  options.accept.max_residual_motion_mm = 1000.0;
  const auto registrar = makeRegistrar(std::make_shared<Device>(), options, {});
  registrar->setVolume(volume);
  const Eigen::Vector3d centre_ct_mm = registrar->centreCt();
  const XrayCamera told{128, 128, 600.0, 600.0, 63.5, 63.5};
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  T_camera_ct.translation() = Eigen::Vector3d(4.0, -3.0, 800.0) - T_camera_ct.linear() * centre_ct_mm;
  const Eigen::Vector3d centre = T_camera_ct * centre_ct_mm;
  const RigidTransform T_view_first(Eigen::Translation3d(centre) * Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitY()) *
                                    Eigen::Translation3d(-centre));
  Noise noise(12);
  std::vector<Twist> errors;
  std::vector<Matrix6d> covariances;
  for (int i = 0; i < kRegistrations; ++i) {
    std::vector<ViewInput> inputs;
    for (std::size_t v = 0; v < views; ++v) {
      XrayCamera seen_by = told;
      seen_by.fx = seen_by.fy = told.fx * (1.0 + options.setup.focal_length * noise.next());
      seen_by.cx += options.setup.principal_point_px * noise.next();
      seen_by.cy += options.setup.principal_point_px * noise.next();
      RigidTransform seen_from = v == 0 ? RigidTransform::Identity() : T_view_first;
      Twist moved;
      for (int k = 0; k < 6; ++k) {
        moved[k] =
            noise.next() * (k < 3 ? options.setup.view_translation_mm : options.setup.view_rotation_deg / 57.2958);
      }
      if (v > 0) seen_from = updatedPose(T_view_first, moved, T_view_first * centre);
      XrayFrame frame;
      frame.camera = told;
      frame.attenuation = registrar->renderDrr(seen_by, seen_from * T_camera_ct);
      for (float& pixel : frame.attenuation.floats().pixels) pixel += static_cast<float>(0.02 * noise.next());
      inputs.emplace_back(std::make_shared<const XrayFrame>(std::move(frame)),
                          v == 0 ? RigidTransform::Identity() : T_view_first);
    }
    const RegistrationResult result = registrar->registerFrame(inputs, T_camera_ct, false);
    errors.push_back(twistBetween(T_camera_ct, result.T_camera_ct, centre));
    covariances.push_back(result.covariance);
  }
  return meanOf(errors, covariances);
}

TEST(Covariance, IsTrueToSizeWithLittleNoise) { expectTrueToSize(normalisedError(0.02)); }

TEST(Covariance, IsTrueToSizeWithMuchNoise) { expectTrueToSize(normalisedError(0.08)); }

TEST(Covariance, HoldsWhatCalibrationLeftOpenInOneView) { expectTrueToSize(normalisedErrorOfWrongSetups(1)); }

TEST(Covariance, HoldsWhatCalibrationLeftOpenInTwoViews) { expectTrueToSize(normalisedErrorOfWrongSetups(2)); }

}  // namespace
}  // namespace xray_registration
