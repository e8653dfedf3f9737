#include "xray_registration/evaluation/trials.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace xray_registration {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

/// Returns the truth moved by a fixed shift in depth, and remembers where it was asked to start.
class ShiftingRegistrar : public Registrar {
 public:
  explicit ShiftingRegistrar(double depth_mm) : depth_mm_(depth_mm) {}

  void setVolume(const AttenuationVolume&) override {}
  bool hasVolume() const override { return true; }
  RegistrationResult registerFrame(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start,
                                   bool tracking) override {
    starts.push_back(T_camera_ct_start);
    was_tracking.push_back(tracking);
    RegistrationResult result;
    // The test hides a frame's truth in its view.
    result.T_camera_ct = views.front().T_view_first;
    result.T_camera_ct.translation().z() += depth_mm_;
    result.accepted = true;
    return result;
  }
  FloatImage renderDrr(const XrayCamera&, const RigidTransform&) override { return {}; }
  Eigen::Vector3d centreCt() const override { return Eigen::Vector3d(10.0, 20.0, 30.0); }
  std::string deviceName() const override { return "none"; }
  std::size_t deviceBytes() const override { return 0; }

  std::vector<RigidTransform> starts;
  std::vector<bool> was_tracking;

 private:
  double depth_mm_;
};

std::vector<EvaluationFrame> someFrames(int count) {
  std::vector<EvaluationFrame> frames;
  for (int i = 0; i < count; ++i) {
    EvaluationFrame frame;
    frame.index = i;
    frame.stamp_s = 100.0 + 0.1 * i;
    frame.T_camera_ct_true.linear() = rotationFromVector(Eigen::Vector3d(0.1, -0.2, 0.01 * i));
    frame.T_camera_ct_true.translation() = Eigen::Vector3d(5.0, -3.0 + i, 900.0);
    frame.prepare_ms = 2.0;
    frame.views.emplace_back(std::make_shared<const XrayFrame>(), frame.T_camera_ct_true);
    frames.push_back(frame);
  }
  return frames;
}

TEST(RandomStarts, StayInTheirRangeAndFillIt) {
  RandomStarts starts({15.0 * kDegree, 25.0}, 7);
  double largest_angle = 0.0;
  Twist mean = Twist::Zero();
  Twist reach = Twist::Zero();
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const Twist start = starts.next();
    EXPECT_LE(start.head<3>().cwiseAbs().maxCoeff(), 25.0);
    // The axis is normalised in double.
    EXPECT_LE(start.tail<3>().norm(), 15.0 * kDegree * (1.0 + 1e-12));
    largest_angle = std::max(largest_angle, start.tail<3>().norm());
    mean += start / kCount;
    reach = reach.cwiseMax(start.cwiseAbs());
  }
  EXPECT_GT(largest_angle, 14.9 * kDegree);
  EXPECT_GT(reach.head<3>().minCoeff(), 24.9);
  // Standard deviation of the mean of 4000 uniform values in ±25 is 0.23 mm; of a rotation component in ±15° about
  // 0.08°. Five of them.
  EXPECT_LT(mean.head<3>().cwiseAbs().maxCoeff(), 1.15);
  EXPECT_LT(mean.tail<3>().cwiseAbs().maxCoeff(), 0.4 * kDegree);
}

TEST(RandomStarts, AxesHaveNoPreferredDirection) {
  RandomStarts starts({1.0, 0.0}, 3);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const Eigen::Vector3d axis = starts.next().tail<3>().normalized();
    scatter += axis * axis.transpose() / kCount;
  }
  // E[a aᵀ] = I/3; each entry's standard deviation is at most 0.3 / √4000 = 0.005. Five of them.
  EXPECT_LT((scatter - Eigen::Matrix3d::Identity() / 3.0).cwiseAbs().maxCoeff(), 0.025);
}

TEST(RandomStarts, SameSeedSameStartsOnEveryPlatform) {
  RandomStarts starts({0.1, 10.0}, 1);
  RandomStarts again({0.1, 10.0}, 1);
  RandomStarts other({0.1, 10.0}, 2);
  const Twist first = starts.next();
  EXPECT_EQ(first, again.next());
  EXPECT_NE(first, other.next());
  EXPECT_NE(first, starts.next());
  // The standard fixes the generator's bits and the arithmetic is IEEE: the values are the same everywhere.
  Twist expected;
  expected << -8.2109361271069119, 1.1235779824475998, 5.7930393901296711, -0.0018300241048526823,
      -0.026628007489140456, 0.0043703003556542792;
  for (int i = 0; i < 6; ++i) EXPECT_DOUBLE_EQ(first(i), expected(i)) << "component " << i;
}

TEST(RunTrials, StartsFromTheDisturbedTruthAndMeasuresBothErrors) {
  ShiftingRegistrar registrar(2.0);
  const auto frames = someFrames(3);
  TrialOptions options;
  options.trials = 7;
  options.range = {6.0 * kDegree, 10.0};
  const Eigen::Vector3d centre_ct_mm(10.0, 20.0, 30.0);
  int last_done = 0;
  const auto trials = runTrials(&registrar, frames, centre_ct_mm, options, [&](int done, int all) {
    EXPECT_EQ(done, last_done + 1);
    EXPECT_EQ(all, 7);
    last_done = done;
  });
  ASSERT_EQ(trials.size(), 7U);
  EXPECT_EQ(last_done, 7);
  // One registration warms up.
  ASSERT_EQ(registrar.starts.size(), 8U);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Trial& trial = trials[i];
    EXPECT_EQ(trial.frame, static_cast<int>(i % 3));
    EXPECT_FALSE(registrar.was_tracking[i + 1]);
    EXPECT_NEAR(trial.final.mtre_mm, 2.0, 1e-9);
    EXPECT_NEAR(trial.final.inplane_mm, 0.0, 1e-9);
    EXPECT_EQ(trial.prepare_ms, 2.0);
    // Turned about the centre, the centre itself moves by the translation alone.
    const RigidTransform& T_true = frames[i % 3].T_camera_ct_true;
    const Eigen::Vector3d moved_mm = registrar.starts[i + 1] * centre_ct_mm - T_true * centre_ct_mm;
    EXPECT_LT((moved_mm - trial.disturbance.head<3>()).norm(), 1e-9);
    EXPECT_NEAR(rotationAngleBetween(registrar.starts[i + 1], T_true), trial.disturbance.tail<3>().norm(), 1e-6);
    EXPECT_GT(trial.start.mtre_mm, 0.0);
  }
}

TEST(RunTrials, APoseThatIsNoPoseIsInfinitelyWrong) {
  ShiftingRegistrar registrar(std::numeric_limits<double>::quiet_NaN());
  TrialOptions options;
  options.trials = 1;
  const auto trials = runTrials(&registrar, someFrames(1), Eigen::Vector3d::Zero(), options);
  EXPECT_TRUE(std::isinf(trials.front().final.mtre_mm));
}

TEST(RunTrials, RefusesWhatItCannotDo) {
  ShiftingRegistrar registrar(0.0);
  TrialOptions options;
  EXPECT_THROW(runTrials(&registrar, {}, Eigen::Vector3d::Zero(), options), std::invalid_argument);
  options.trials = 0;
  EXPECT_THROW(runTrials(&registrar, someFrames(1), Eigen::Vector3d::Zero(), options), std::invalid_argument);
  options.trials = 1;
  options.range.translation_mm = -1.0;
  EXPECT_THROW(runTrials(&registrar, someFrames(1), Eigen::Vector3d::Zero(), options), std::invalid_argument);
  options.range.translation_mm = 0.0;
  options.target_size_mm = 0.0;
  EXPECT_THROW(runTrials(&registrar, someFrames(1), Eigen::Vector3d::Zero(), options), std::invalid_argument);
}

TEST(FollowFrames, StartsFromTheTruthOnceAndThenFromItself) {
  ShiftingRegistrar registrar(0.0);
  Tracker tracker{TrackerOptions{}};
  const auto frames = someFrames(4);
  const auto trials = followFrames(&registrar, &tracker, frames, registrar.centreCt(), 100.0);
  ASSERT_EQ(trials.size(), 4U);
  EXPECT_EQ(trials[0].start.mtre_mm, 0.0);
  // The second frame starts where the first was found: the motion in between is its start error.
  const auto targets = targetGrid(registrar.centreCt(), 100.0);
  EXPECT_NEAR(trials[1].start.mtre_mm,
              poseError(frames[0].T_camera_ct_true, frames[1].T_camera_ct_true, targets).mtre_mm, 1e-9);
  // From the third on the velocity is known; the motion is constant but for the turn of the axes (0.01 rad a frame).
  EXPECT_LT(trials[2].start.mtre_mm, 0.1 * trials[1].start.mtre_mm);
  for (const Trial& trial : trials) EXPECT_NEAR(trial.final.mtre_mm, 0.0, 1e-9);
  EXPECT_FALSE(registrar.was_tracking[1]);
  EXPECT_TRUE(registrar.was_tracking[2]);
}

}  // namespace
}  // namespace xray_registration
