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

NormalisedError normalisedError(double noise_deviation) {
  const AttenuationVolume volume = toAttenuation(headPhantom(2.5), AttenuationModel{});
  const auto registrar = makeRegistrar(std::make_shared<Device>(), RegistrarOptions{}, {});
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
  NormalisedError sum;
  for (int i = 0; i < kRegistrations; ++i) {
    view.attenuation = clean;
    for (float& pixel : view.attenuation.pixels) pixel += static_cast<float>(noise_deviation * noise.next());
    const RegistrationResult result = registrar->registerFrame({view}, T_camera_ct, false);
    const Twist error = twistBetween(T_camera_ct, result.T_camera_ct, T_camera_ct * centre_ct_mm);
    const Matrix6d& covariance = result.covariance;
    sum.all += error.dot(covariance.ldlt().solve(error)) / 6.0;
    const Eigen::Vector3d inplane(error(0), error(1), error(5));
    Eigen::Matrix3d inplane_covariance;
    const int of[3] = {0, 1, 5};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) inplane_covariance(r, c) = covariance(of[r], of[c]);
    }
    sum.inplane += inplane.dot(inplane_covariance.ldlt().solve(inplane)) / 3.0;
    sum.depth += error(2) * error(2) / covariance(2, 2);
  }
  return {sum.all / kRegistrations, sum.inplane / kRegistrations, sum.depth / kRegistrations};
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

TEST(Covariance, IsTrueToSizeWithLittleNoise) { expectTrueToSize(normalisedError(0.02)); }

TEST(Covariance, IsTrueToSizeWithMuchNoise) { expectTrueToSize(normalisedError(0.08)); }

}  // namespace
}  // namespace xray_registration
