#include "xray_registration/evaluation/trials.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

#include "xray_registration/drr/device.h"
#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

/// What the registrar below was asked, and what it is to do.
struct Script {
  double depth_mm = 0.0;    ///< How far its answer lies behind the truth.
  bool solves = true;       ///< Else it refuses the start.
  int frames_to_fail = -1;  ///< From this one on the device fails.
  std::vector<RigidTransform> starts;
  std::vector<bool> was_tracking;
  int forgotten = 0;
};

/// Returns the truth moved by a fixed shift in depth, and remembers where it was asked to start.
class ShiftingRegistrar : public Registrar {
 public:
  explicit ShiftingRegistrar(Script* script) : script_(script) {}

  void setVolume(const AttenuationVolume&) override {}
  bool hasVolume() const override { return true; }
  RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start,
                                   bool tracking) override {
    script_->starts.push_back(T_camera_ct_start);
    script_->was_tracking.push_back(tracking);
    if (script_->frames_to_fail >= 0 && static_cast<int>(script_->starts.size()) > script_->frames_to_fail) {
      throw DeviceError("device lost", -5);
    }
    RegistrationResult result;
    if (!script_->solves) {
      result.reason = "the start is of no use";
      return result;
    }
    // The test hides a frame's truth in its second view.
    result.T_camera_ct = views.back().T_view_first;
    result.T_camera_ct.translation().z() += script_->depth_mm;
    result.solved = result.accepted = true;
    return result;
  }
  void forget() override { ++script_->forgotten; }
  FloatImage renderDrr(const XrayCamera&, const RigidTransform&) override { return {}; }
  Eigen::Vector3d centreCt() const override { return Eigen::Vector3d(10.0, 20.0, 30.0); }
  std::string deviceName() const override { return "none"; }
  std::size_t deviceBytes() const override { return 0; }

 private:
  Script* script_;
};

const Eigen::Vector3d kCentreCtMm(10.0, 20.0, 30.0);

RawView someView(const std::string& name) {
  RawView view;
  view.name = name;
  view.image = RawImage{FloatImage(32, 24), 65535.0};
  for (std::size_t i = 0; i < view.image->pixels.floats.pixels.size(); ++i) {
    view.image->pixels.floats.pixels[i] = 20000.0F + 100.0F * static_cast<float>(i % 97);
  }
  view.calibration.width = 32;
  view.calibration.height = 24;
  view.calibration.k = {1000, 0, 15.5, 0, 1000, 11.5, 0, 0, 1};
  return view;
}

std::vector<EvaluationFrame> someFrames(int count) {
  std::vector<EvaluationFrame> frames;
  for (int i = 0; i < count; ++i) {
    EvaluationFrame frame;
    frame.index = i;
    frame.stamp_s = 100.0 + 0.1 * i;
    frame.T_camera_ct_true.linear() = rotationFromVector(Eigen::Vector3d(0.1, -0.2, 0.01 * i));
    frame.T_camera_ct_true.translation() = Eigen::Vector3d(5.0, -3.0 + i, 900.0);
    frame.views = {someView("a"), someView("b")};
    frame.views.back().T_view_first = frame.T_camera_ct_true;
    frames.push_back(frame);
  }
  return frames;
}

class Trials : public testing::Test {
 protected:
  void SetUp() override { pipeline_.setCt(whiteCube(16)); }

  static NodeParameters twoViews() {
    NodeParameters parameters;
    parameters.views = {"a", "b"};
    return parameters;
  }

  Script script_;
  RegistrationPipeline pipeline_{
      twoViews(), [this](const RegistrarOptions&) { return std::make_unique<ShiftingRegistrar>(&script_); }, {}};
};

TEST_F(Trials, StartFromTheDisturbedTruthAndMeasureBothErrors) {
  script_.depth_mm = 2.0;
  const auto frames = someFrames(3);
  TrialOptions options;
  options.trials = 7;
  options.range = {6.0 * kDegree, 10.0};
  int last_done = 0;
  const auto trials = runTrials(&pipeline_, frames, kCentreCtMm, options, [&](int done, int all) {
    EXPECT_EQ(done, last_done + 1);
    EXPECT_EQ(all, 7);
    last_done = done;
  });
  ASSERT_EQ(trials.size(), 7U);
  EXPECT_EQ(last_done, 7);
  // One registration warms up.
  ASSERT_EQ(script_.starts.size(), 8U);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Trial& trial = trials[i];
    EXPECT_EQ(trial.frame, static_cast<int>(i % 3));
    EXPECT_FALSE(script_.was_tracking[i + 1]);
    EXPECT_NEAR(trial.final.mtre_mm, 2.0, 1e-9);
    EXPECT_NEAR(trial.final.inplane_mm, 0.0, 1e-9);
    EXPECT_GT(trial.prepare_ms, 0.0);
    EXPECT_GT(trial.solve_ms, 0.0);
    // Turned about the centre, the centre itself moves by the translation alone.
    const RigidTransform& T_true = frames[i % 3].T_camera_ct_true;
    const Eigen::Vector3d moved_mm = script_.starts[i + 1] * kCentreCtMm - T_true * kCentreCtMm;
    EXPECT_LT((moved_mm - trial.disturbance.head<3>()).norm(), 1e-9);
    EXPECT_NEAR(rotationAngleBetween(script_.starts[i + 1], T_true), trial.disturbance.tail<3>().norm(), 1e-6);
    EXPECT_GT(trial.start.mtre_mm, 0.0);
  }
  // What one trial taught must not help the next.
  EXPECT_GE(script_.forgotten, 8);
}

TEST_F(Trials, WhereNothingWasFoundTheErrorIsThatOfTheStart) {
  TrialOptions options;
  options.trials = 1;
  options.range = {6.0 * kDegree, 10.0};
  for (const bool gives_nan : {true, false}) {
    script_.depth_mm = gives_nan ? std::numeric_limits<double>::quiet_NaN() : 0.0;
    script_.solves = gives_nan;
    const Trial trial = runTrials(&pipeline_, someFrames(1), kCentreCtMm, options).front();
    EXPECT_FALSE(trial.result.accepted);
    EXPECT_FALSE(trial.result.reason.empty());
    EXPECT_GT(trial.start.mtre_mm, 1.0);
    EXPECT_EQ(trial.final.mtre_mm, trial.start.mtre_mm);
  }
}

TEST_F(Trials, ADeviceThatStaysBrokenEndsThem) {
  script_.frames_to_fail = 2;
  TrialOptions options;
  options.trials = 5;
  EXPECT_THROW(runTrials(&pipeline_, someFrames(1), kCentreCtMm, options), DeviceError);
}

TEST_F(Trials, RefuseWhatTheyCannotDo) {
  TrialOptions options;
  EXPECT_THROW(runTrials(&pipeline_, {}, kCentreCtMm, options), std::invalid_argument);
  options.trials = 0;
  EXPECT_THROW(runTrials(&pipeline_, someFrames(1), kCentreCtMm, options), std::invalid_argument);
  options.trials = 1;
  options.range.translation_mm = -1.0;
  EXPECT_THROW(runTrials(&pipeline_, someFrames(1), kCentreCtMm, options), std::invalid_argument);
  options.range.translation_mm = 0.0;
  options.target_size_mm = 0.0;
  EXPECT_THROW(runTrials(&pipeline_, someFrames(1), kCentreCtMm, options), std::invalid_argument);
}

TEST_F(Trials, FollowingStartsFromTheTruthOnceAndThenFromItself) {
  const auto frames = someFrames(4);
  const auto trials = followFrames(&pipeline_, frames, kCentreCtMm, 100.0);
  ASSERT_EQ(trials.size(), 4U);
  EXPECT_EQ(trials[0].start.mtre_mm, 0.0);
  // The second frame starts where the first was found: the motion in between is its start error.
  const auto targets = targetGrid(kCentreCtMm, 100.0);
  EXPECT_NEAR(trials[1].start.mtre_mm,
              poseError(frames[0].T_camera_ct_true, frames[1].T_camera_ct_true, targets).mtre_mm, 1e-9);
  // From the third on the velocity is known; the motion is constant but for the turn of the axes (0.01 rad a frame).
  EXPECT_LT(trials[2].start.mtre_mm, 0.1 * trials[1].start.mtre_mm);
  for (const Trial& trial : trials) EXPECT_NEAR(trial.final.mtre_mm, 0.0, 1e-9);
  EXPECT_FALSE(script_.was_tracking[1]);
  EXPECT_TRUE(script_.was_tracking[2]);
}

}  // namespace
}  // namespace xray_registration
