// The whole way from start to verdict on X-rays that the project's exact projector and physics made from a phantom, not
// by the renderer that registers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "xray_registration/drr/device.h"
#include "xray_registration/evaluation/random_starts.h"
#include "xray_registration/evaluation/trial_statistics.h"
#include "xray_registration/evaluation/xray_simulator.h"
#include "xray_registration/registration/registrar_factory.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

XrayCamera camera() { return {128, 128, 600.0, 600.0, 63.5, 63.5}; }

/// Antero-posterior, or turned about the long axis; the CT's centre 800 mm from the source.
RigidTransform posed(const Eigen::Vector3d& centre_ct_mm, double angle_rad) {
  Eigen::Matrix3d R_camera_ct;
  R_camera_ct.row(0) << std::cos(angle_rad), std::sin(angle_rad), 0.0;
  R_camera_ct.row(1) << 0.0, 0.0, -1.0;
  R_camera_ct.row(2) << -std::sin(angle_rad), std::cos(angle_rad), 0.0;
  RigidTransform T_camera_ct = RigidTransform::Identity();
  T_camera_ct.linear() = R_camera_ct;
  T_camera_ct.translation() = Eigen::Vector3d(0.0, 0.0, 800.0) - R_camera_ct * centre_ct_mm;
  return T_camera_ct;
}

/// −log of the detector's counts: an attenuation up to an offset.
FloatImage attenuationOf(const Image<std::uint16_t>& counts) {
  FloatImage image(counts.width, counts.height);
  for (std::size_t i = 0; i < counts.pixels.size(); ++i) {
    image.pixels[i] = static_cast<float>(std::log(65536.0) - std::log(counts.pixels[i] + 1.0));
  }
  return image;
}

/// One frame with its true pose.
struct SimulatedFrame {
  std::vector<ViewInput> views;
  RigidTransform T_camera_ct_true = RigidTransform::Identity();
};

class SimulatedSession : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    state_ = std::make_unique<State>();
    state_->volume = toAttenuation(headPhantom(2.5), AttenuationModel{});
    state_->registrar = makeRegistrar(std::make_shared<Device>(), RegistrarOptions{}, {});
    state_->registrar->setVolume(state_->volume);
  }
  static void TearDownTestSuite() { state_.reset(); }

  static Registrar* registrar() { return state_->registrar.get(); }
  static Eigen::Vector3d centre() { return state_->volume.grid.centreCt(); }

  /// Cold registrations from random starts within six degrees and ten millimetres.
  static std::vector<Trial> trials(const std::vector<SimulatedFrame>& frames, int count) {
    const auto targets_ct_mm = targetGrid(centre(), 100.0);
    RandomStarts starts({6.0 * kDegree, 10.0}, 1);
    std::vector<Trial> made(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < made.size(); ++i) {
      const SimulatedFrame& frame = frames[i % frames.size()];
      const RigidTransform start =
          updatedPose(frame.T_camera_ct_true, starts.next(), frame.T_camera_ct_true * centre());
      made[i].result = registrar()->registerFrame(frame.views, start, false);
      made[i].start = poseError(start, frame.T_camera_ct_true, targets_ct_mm);
      made[i].final = poseError(made[i].result.T_camera_ct, frame.T_camera_ct_true, targets_ct_mm);
    }
    return made;
  }

  static SimulatedFrame frame(int index, const std::vector<double>& angles_rad) {
    std::mt19937_64 random(100U + static_cast<unsigned>(index));
    RandomStarts motion({4.0 * kDegree, 5.0}, 50U + static_cast<unsigned>(index));
    const Twist moved = motion.next();
    SimulatedFrame made;
    const RigidTransform T_first_rest = posed(centre(), angles_rad.front());
    made.T_camera_ct_true = updatedPose(T_first_rest, moved, T_first_rest * centre());
    for (const double angle_rad : angles_rad) {
      const RigidTransform T_view_first = posed(centre(), angle_rad) * T_first_rest.inverse();
      auto xray = std::make_shared<XrayFrame>();
      xray->camera = camera();
      xray->attenuation = attenuationOf(
          simulateXray(state_->volume, T_view_first * made.T_camera_ct_true, camera(), XrayPhysics{}, &random));
      made.views.emplace_back(xray, T_view_first);
    }
    return made;
  }

  struct State {
    AttenuationVolume volume;
    std::unique_ptr<Registrar> registrar;
  };
  static std::unique_ptr<State> state_;
};

std::unique_ptr<SimulatedSession::State> SimulatedSession::state_;

TEST_F(SimulatedSession, OneViewIsFoundFromSixDegreesAndTenMillimetres) {
  const std::vector<SimulatedFrame> frames = {frame(0, {0.0}), frame(1, {0.0})};
  const TrialStatistics statistics = statisticsOf(trials(frames, 10), successCriteria(1));
  // The goal on recorded sessions is 95 to 99 %; ten trials allow one failure.
  EXPECT_GE(statistics.successes, 9);
  EXPECT_EQ(statistics.false_acceptances, 0);
  EXPECT_GE(statistics.accepted, 8);
  // Pixels are 1.3 mm at the centre and voxels 2.5 mm; sub-pixel by a factor of ten is what a recorded session reaches.
  EXPECT_LT(statistics.final_inplane_mm.median, 0.15);
}

TEST_F(SimulatedSession, TwoViewsSeeDepth) {
  const std::vector<SimulatedFrame> frames = {frame(2, {0.0, -50.0 * kDegree})};
  const TrialStatistics statistics = statisticsOf(trials(frames, 6), successCriteria(2));
  EXPECT_GE(statistics.successes, 5);
  EXPECT_EQ(statistics.false_acceptances, 0);
  EXPECT_LT(statistics.final_mtre_mm.median, 0.5);
}

TEST_F(SimulatedSession, TheSameTrialGivesTheSameBits) {
  const std::vector<SimulatedFrame> frames = {frame(0, {0.0})};
  const auto once = trials(frames, 2);
  const auto again = trials(frames, 2);
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_EQ(once[i].result.T_camera_ct.matrix(), again[i].result.T_camera_ct.matrix()) << "trial " << i;
    EXPECT_EQ(once[i].result.iterations, again[i].result.iterations);
  }
}

TEST_F(SimulatedSession, AnXrayOfSomethingElseIsNotAccepted) {
  const AttenuationVolume pelvis = toAttenuation(pelvisPhantom(4.0), AttenuationModel{});
  const RigidTransform T_camera_pelvis = posed(pelvis.grid.centreCt(), 0.0);
  const RigidTransform start = posed(centre(), 0.0);
  std::mt19937_64 random(5);
  XrayFrame view;
  view.camera = camera();
  view.attenuation = attenuationOf(simulateXray(pelvis, T_camera_pelvis, camera(), XrayPhysics{}, &random));
  const RegistrationResult result = registrar()->registerFrame({view}, start, false);
  EXPECT_FALSE(result.accepted) << "similarity " << result.similarity;
  EXPECT_FALSE(result.reason.empty());
  EXPECT_TRUE(result.T_camera_ct.matrix().allFinite());
}

TEST_F(SimulatedSession, NoiseAloneIsNotAccepted) {
  const RigidTransform start = posed(centre(), 0.0);
  std::mt19937_64 random(6);
  XrayFrame view;
  view.camera = camera();
  view.attenuation = FloatImage(camera().width, camera().height);
  for (float& pixel : view.attenuation.floats().pixels) pixel = static_cast<float>(random() >> 11U) * 0x1.0p-53F;
  const RegistrationResult result = registrar()->registerFrame({view}, start, false);
  EXPECT_FALSE(result.accepted) << "similarity " << result.similarity;
  EXPECT_FALSE(result.reason.empty());
  EXPECT_TRUE(result.T_camera_ct.matrix().allFinite());
}

}  // namespace
}  // namespace xray_registration
