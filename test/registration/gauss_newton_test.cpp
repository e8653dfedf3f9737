#include "xray_registration/registration/gauss_newton.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace xray_registration {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Eigen::Vector3d kCentre{12.0, -30.0, 250.0};

/// Half the squared distances of eight marks from where they belong: zero at `truth`, quadratic in the translation.
/// `matrix_scale` other than 1 lies about the curvature.
struct Marks {
  RigidTransform truth = RigidTransform::Identity();
  double matrix_scale = 1.0;
  std::vector<RigidTransform> asked;
  std::vector<double> costs;

  StepSums operator()(const RigidTransform& pose) {
    StepSums sums;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d offset(corner & 1 ? 40 : -50, corner & 2 ? 35 : -45, corner & 4 ? 60 : -30);
      const Eigen::Vector3d residual = pose * (kCentre + offset) - truth * (kCentre + offset);
      const Eigen::Vector3d arm = pose.linear() * offset;
      Eigen::Matrix<double, 3, 6> jacobian;
      jacobian.leftCols<3>().setIdentity();
      jacobian.rightCols<3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
      sums.matrix += matrix_scale * jacobian.transpose() * jacobian;
      sums.gradient += jacobian.transpose() * residual;
      sums.cost += 0.5 * residual.squaredNorm();
    }
    sums.weight = 8.0;
    asked.push_back(pose);
    costs.push_back(sums.cost);
    return sums;
  }
};

RigidTransform start() {
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotationFromVector({0.5, -1.2, 0.3});
  pose.translation() = Eigen::Vector3d(4, -7, 800) - pose.linear() * kCentre;
  return pose;
}

RigidTransform moved(const Twist& twist) { return updatedPose(start(), twist, start() * kCentre); }

Twist twist(double x, double y, double z, double rx, double ry, double rz) {
  Twist result;
  result << x, y, z, rx, ry, rz;
  return result;
}

double distanceMm(const RigidTransform& a, const RigidTransform& b) {
  return (a * kCentre - b * kCentre).norm() + 60.0 * rotationAngleBetween(a, b);
}

GaussNewtonOptions exactOptions() {
  GaussNewtonOptions options;
  options.max_steps = 30;
  options.stop_mm = 1e-6;
  return options;
}

TEST(GaussNewtonTest, QuadraticCostIsSolvedInFewSteps) {
  Marks marks;
  marks.truth = moved(twist(5, -3, 8, 0, 0, 0));
  const GaussNewtonResult result = minimise(std::ref(marks), start(), kCentre, exactOptions());
  EXPECT_TRUE(result.converged);
  EXPECT_FALSE(result.failed);
  // The damping of 1e-3 leaves a thousandth of the way in the first step, and falls from step to step.
  EXPECT_LE(result.steps, 5);
  EXPECT_LT(distanceMm(result.T_camera_ct, marks.truth), 1e-5);
}

TEST(GaussNewtonTest, RotationsAreSolvedAboutTheCentre) {
  Marks marks;
  marks.truth = moved(twist(3, 4, -6, 0.12, -0.2, 0.15));
  const GaussNewtonResult result = minimise(std::ref(marks), start(), kCentre, exactOptions());
  EXPECT_TRUE(result.converged);
  EXPECT_LE(result.steps, 8);
  EXPECT_LT(distanceMm(result.T_camera_ct, marks.truth), 1e-5);
  EXPECT_TRUE(isRigid(result.T_camera_ct.matrix(), 1e-9));
  EXPECT_NEAR(result.sums.cost, 0.0, 1e-9);
}

TEST(GaussNewtonTest, DampingCopesWithUnderstatedCurvature) {
  // A matrix five times too small makes every undamped step overshoot to four times the distance.
  Marks marks;
  marks.matrix_scale = 0.2;
  marks.truth = moved(twist(2, -1, 4, 0.03, 0.02, -0.04));
  GaussNewtonOptions options = exactOptions();
  options.max_steps = 60;
  options.stop_mm = 1e-4;
  const GaussNewtonResult result = minimise(std::ref(marks), start(), kCentre, options);
  EXPECT_TRUE(result.converged);
  EXPECT_LT(distanceMm(result.T_camera_ct, marks.truth), 1e-3);
  // The scene does what it is for: some step was too long.
  EXPECT_FALSE(std::is_sorted(marks.costs.rbegin(), marks.costs.rend()));
}

TEST(GaussNewtonTest, ResultIsTheBestOfAllPosesThatWereTried) {
  for (const int max_steps : {1, 2, 3, 4, 6, 9}) {
    Marks marks;
    marks.matrix_scale = 0.15;
    marks.truth = moved(twist(2, -1, 4, 0.03, 0.02, -0.04));
    GaussNewtonOptions options = exactOptions();
    options.max_steps = max_steps;
    const GaussNewtonResult result = minimise(std::ref(marks), start(), kCentre, options);
    EXPECT_EQ(result.steps, max_steps);
    EXPECT_EQ(static_cast<int>(marks.asked.size()), max_steps);
    EXPECT_FALSE(result.converged);
    const auto best = std::min_element(marks.costs.begin(), marks.costs.end());
    EXPECT_EQ(result.sums.cost, *best);
    const auto index = static_cast<std::size_t>(best - marks.costs.begin());
    EXPECT_EQ(result.T_camera_ct.matrix(), marks.asked[index].matrix());
  }
}

TEST(GaussNewtonTest, StepsStayInsideTheTrustRegion) {
  Marks marks;
  marks.truth = moved(twist(120, 0, 0, 0.6, 0, 0));
  GaussNewtonOptions options = exactOptions();
  options.max_steps = 2;
  options.max_step_mm = 7.0;
  options.max_step_rad = 0.1;
  minimise(std::ref(marks), start(), kCentre, options);
  ASSERT_EQ(marks.asked.size(), 2U);
  const Twist step = twistBetween(marks.asked[0], marks.asked[1], marks.asked[0] * kCentre);
  EXPECT_LE(step.head<2>().norm(), 7.0 + 1e-9);
  EXPECT_LE(step.tail<3>().norm(), 0.1 + 1e-9);
  // The longer of the two bounds is used up.
  EXPECT_GT(std::max(step.head<2>().norm() / 7.0, step.tail<3>().norm() / 0.1), 1.0 - 1e-6);
}

TEST(GaussNewtonTest, TheLastShortStepIsTakenUntested) {
  Marks marks;
  marks.truth = moved(twist(0.4, -0.3, 0.5, 0, 0, 0));
  GaussNewtonOptions options = exactOptions();
  options.max_steps = 1;
  const GaussNewtonResult tested = minimise(std::ref(marks), start(), kCentre, options);
  EXPECT_EQ(tested.T_camera_ct.matrix(), start().matrix());
  EXPECT_FALSE(tested.converged);
  options.max_untested_step_mm = 1.0;
  const GaussNewtonResult untested = minimise(std::ref(marks), start(), kCentre, options);
  EXPECT_TRUE(untested.converged);
  EXPECT_EQ(untested.steps, 1);
  // The initial damping leaves a thousandth of 0.7 mm.
  EXPECT_LT(distanceMm(untested.T_camera_ct, marks.truth), 2e-3);
  options.max_untested_step_mm = 0.1;  // The step is 0.5 mm in the image.
  EXPECT_FALSE(minimise(std::ref(marks), start(), kCentre, options).converged);
}

TEST(GaussNewtonTest, SingularMatrixFails) {
  const auto blind_to_depth = [](const RigidTransform& pose) {
    Marks marks;
    marks.truth = moved(twist(1, 1, 1, 0, 0, 0));
    StepSums sums = marks(pose);
    sums.matrix.row(2).setZero();
    sums.matrix.col(2).setZero();
    return sums;
  };
  const GaussNewtonResult result = minimise(blind_to_depth, start(), kCentre, exactOptions());
  EXPECT_TRUE(result.failed);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.steps, 1);
  EXPECT_EQ(result.T_camera_ct.matrix(), start().matrix());
}

TEST(GaussNewtonTest, NothingToSeeFails) {
  const GaussNewtonResult result =
      minimise([](const RigidTransform&) { return StepSums{}; }, start(), kCentre, exactOptions());
  EXPECT_TRUE(result.failed);
  EXPECT_EQ(result.T_camera_ct.matrix(), start().matrix());
}

TEST(GaussNewtonTest, NotFiniteAtTheStartFails) {
  for (int part = 0; part < 3; ++part) {
    const auto broken = [&](const RigidTransform& pose) {
      StepSums sums = Marks{}(pose);
      if (part == 0) sums.cost = kNan;
      if (part == 1) sums.gradient[3] = std::numeric_limits<double>::infinity();
      if (part == 2) sums.matrix(4, 1) = kNan;
      return sums;
    };
    const GaussNewtonResult result = minimise(broken, start(), kCentre, exactOptions());
    EXPECT_TRUE(result.failed) << "part " << part;
    EXPECT_EQ(result.T_camera_ct.matrix(), start().matrix());
  }
}

TEST(GaussNewtonTest, PosesWithoutAFiniteCostAreNeverTaken) {
  // Not a number beyond 2 mm from the start: the far truth must not pull the pose there.
  Marks marks;
  marks.truth = moved(twist(10, 0, 0, 0, 0, 0));
  const auto walled = [&](const RigidTransform& pose) {
    StepSums sums = marks(pose);
    if ((pose * kCentre - start() * kCentre).norm() > 2.0) sums.cost = kNan;
    return sums;
  };
  for (const int max_steps : {8, 100}) {
    GaussNewtonOptions options = exactOptions();
    options.max_steps = max_steps;
    options.max_untested_step_mm = 0.1;
    const GaussNewtonResult result = minimise(walled, start(), kCentre, options);
    EXPECT_TRUE(result.sums.finite());
    EXPECT_TRUE(result.T_camera_ct.matrix().allFinite());
    EXPECT_LE((result.T_camera_ct * kCentre - start() * kCentre).norm(), 2.0);
    EXPECT_FALSE(result.converged) << "the cost still falls towards the wall";
  }
}

TEST(GaussNewtonTest, FiniteAtTheStartOnlyFails) {
  const auto lonely = [](const RigidTransform& pose) {
    Marks marks;
    marks.truth = moved(twist(5, -3, 8, 0, 0, 0));
    StepSums sums = marks(pose);
    if (distanceMm(pose, start()) > 0.0) sums.gradient[2] = kNan;
    return sums;
  };
  // Ended by the budget, by a step that damping made short, and by the damping's bound.
  for (const double stop_mm : {1e-9, 0.02}) {
    for (const int max_steps : {2, 5, 100}) {
      GaussNewtonOptions options;
      options.max_steps = max_steps;
      options.stop_mm = stop_mm;
      options.max_untested_step_mm = 100.0 * stop_mm;
      const GaussNewtonResult result = minimise(lonely, start(), kCentre, options);
      EXPECT_TRUE(result.failed) << stop_mm << " mm, " << max_steps << " steps";
      EXPECT_FALSE(result.converged);
      EXPECT_EQ(result.T_camera_ct.matrix(), start().matrix());
    }
  }
}

TEST(GaussNewtonTest, WorseAllAroundIsAMinimumWhateverLiesFarther) {
  // A gradient that lies: the start is the minimum already, and no number beyond 0.1 mm from it.
  const auto basin = [](const RigidTransform& pose) {
    Marks marks;
    marks.truth = start();
    StepSums sums = marks(pose);
    sums.gradient[0] += 8.0;
    if (distanceMm(pose, start()) > 0.1) sums.cost = kNan;
    return sums;
  };
  for (const double stop_mm : {1e-9, 1e-3}) {
    GaussNewtonOptions options;
    options.max_steps = 100;
    options.stop_mm = stop_mm;
    const GaussNewtonResult result = minimise(basin, start(), kCentre, options);
    EXPECT_TRUE(result.converged) << stop_mm << " mm";
    EXPECT_FALSE(result.failed);
    EXPECT_EQ(result.T_camera_ct.matrix(), start().matrix());
  }
}

TEST(GaussNewtonTest, ManyAtOnceGiveWhatOneByOneGives) {
  Marks marks;
  marks.matrix_scale = 0.4;
  marks.truth = moved(twist(5, -3, 8, 0.1, 0.05, 0));
  std::vector<RigidTransform> starts = {marks.truth, start()};
  for (int i = 1; i < 5; ++i) starts.push_back(moved(twist(3.0 * i, -2.0 * i, 0, 0.02 * i, 0, -0.1)));
  GaussNewtonOptions options = exactOptions();
  options.max_steps = 12;
  std::size_t largest_batch = 0;
  const auto batch = [&](const std::vector<RigidTransform>& poses) {
    largest_batch = std::max(largest_batch, poses.size());
    std::vector<StepSums> sums;
    for (const RigidTransform& pose : poses) sums.push_back(marks(pose));
    return sums;
  };
  const std::vector<GaussNewtonResult> together = minimiseMany(batch, starts, kCentre, options);
  ASSERT_EQ(together.size(), starts.size());
  EXPECT_EQ(largest_batch, starts.size());
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const GaussNewtonResult alone = minimise(std::ref(marks), starts[i], kCentre, options);
    EXPECT_EQ(alone.T_camera_ct.matrix(), together[i].T_camera_ct.matrix()) << "start " << i;
    EXPECT_EQ(alone.steps, together[i].steps);
    EXPECT_EQ(alone.converged, together[i].converged);
    EXPECT_EQ(alone.failed, together[i].failed);
    EXPECT_EQ(alone.sums.cost, together[i].sums.cost);
  }
  EXPECT_TRUE(minimiseMany(batch, {}, kCentre, options).empty());
}

TEST(GaussNewtonTest, DampedStepSolvesItsSystem) {
  Marks marks;
  marks.truth = moved(twist(5, -3, 8, 0.1, 0.05, -0.2));
  const StepSums sums = marks(start());
  for (const double damping : {0.0, 1e-3, 1.0, 1e3}) {
    Twist step;
    ASSERT_TRUE(dampedStep(sums, damping, &step));
    Matrix6d system = sums.matrix;
    system.diagonal() *= 1.0 + damping;
    // Double precision and a condition number of about 1e4.
    EXPECT_LT((system * step + sums.gradient).norm(), 1e-9 * sums.gradient.norm());
  }
}

TEST(GaussNewtonTest, DampedStepRefusesWhatHasNoMinimum) {
  Twist step;
  StepSums sums;
  EXPECT_FALSE(dampedStep(sums, 1e-3, &step));  // All zero.
  sums.matrix.setIdentity();
  sums.matrix(2, 2) = -1.0;
  EXPECT_FALSE(dampedStep(sums, 1e-3, &step));
  sums.matrix.setIdentity();
  sums.matrix(0, 1) = sums.matrix(1, 0) = 2.0;  // Indefinite with a positive diagonal.
  EXPECT_FALSE(dampedStep(sums, 1e-3, &step));
  sums.matrix.setOnes();  // Rank one: undamped it has no solution.
  EXPECT_FALSE(dampedStep(sums, 0.0, &step));
  sums.matrix.setIdentity();
  sums.gradient[5] = kNan;
  EXPECT_FALSE(dampedStep(sums, 1e-3, &step));
}

TEST(MinimiseTest, AnObjectiveThatDeclinesEndsTheDescentWhereItIs) {
  Marks marks;
  marks.truth = moved(twist(3.0, -2.0, 5.0, 0.02, -0.03, 0.01));
  int left = 1;
  const auto declines = [&](const RigidTransform& pose) -> std::optional<StepSums> {
    if (left-- == 0) return std::nullopt;
    return marks(pose);
  };
  const GaussNewtonResult cut = minimise(declines, start(), kCentre, {});
  EXPECT_EQ(cut.steps, 1);
  EXPECT_FALSE(cut.converged);
  EXPECT_FALSE(cut.failed);
  EXPECT_EQ(cut.sums.cost, marks.costs.front());

  const GaussNewtonResult none =
      minimise([](const RigidTransform&) -> std::optional<StepSums> { return std::nullopt; }, start(), kCentre, {});
  EXPECT_EQ(none.steps, 0);
  EXPECT_FALSE(none.converged);
  EXPECT_EQ(none.T_camera_ct.matrix(), start().matrix());

  const auto many = minimiseMany([](const std::vector<RigidTransform>&) { return std::vector<StepSums>{}; },
                                 {start(), start()}, kCentre, {});
  ASSERT_EQ(many.size(), 2U);
  EXPECT_EQ(many[1].steps, 0);
  EXPECT_FALSE(many[1].converged);
}

}  // namespace
}  // namespace xray_registration
