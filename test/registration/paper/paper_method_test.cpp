#include "xray_registration/registration/paper/paper_method.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "xray_registration/volume/phantom.h"

namespace xray_registration {
namespace {

struct Experiment {
  PaperProblem problem;
  AttenuationVolume volume;
};

Experiment experiment(const Volume& ct, int image_size, double unit_mm) {
  Experiment made;
  made.volume = toAttenuation(ct, {});
  const VolumeGrid& grid = made.volume.grid;
  const PaperGeometry geometry = paperGeometry(grid, image_size, 2.0 * grid.size.x() * grid.spacing_mm.x());
  made.problem.camera = geometry.camera;
  made.problem.T_camera_ct_start = geometry.T_camera_ct;
  made.problem.centre_ct_mm = grid.centreCt();
  made.problem.unit_mm = unit_mm;
  made.problem.samples = paperSampleCount(grid, geometry.T_camera_ct);
  return made;
}

/// The engine with the experiment's volume and, as target, gain · DRR(truth) + offset.
void aim(PaperEngine* engine, const Experiment& made, const PaperParameters& truth, float gain = 1.0F,
         float offset = 0.0F) {
  const PaperProblem& problem = made.problem;
  engine->setVolume(made.volume);
  engine->setTarget(FloatImage(problem.camera.width, problem.camera.height), {}, {});
  engine->render(
      0, paperRays(engine->grid(), problem.camera, paperPose(problem, truth), problem.samples, problem.line_integrals));
  FloatImage target = engine->read(0);
  for (float& pixel : target.pixels) pixel = gain * pixel + offset;
  engine->setTarget(target, {}, {});
}

PaperParameters six(double angle, double shift) {
  PaperParameters s;
  s << angle, angle, angle, shift, shift, shift;
  return s;
}

TEST(PaperMethod, WhiteCubeOfThePaperConverges) {
  const Experiment made = experiment(whiteCube(32), 32, 100.0);
  PaperOptions options;
  options.translation_step = 0.005;
  const PaperParameters truth = six(5.0, 0.1);
  for (const bool on_device : {false, true}) {
    const auto engine = on_device ? makePaperEngineOpenCl(std::make_shared<Device>()) : makePaperEngineCpp();
    aim(engine.get(), made, truth);
    const PaperSolution solution = solvePaper(engine.get(), made.problem, options);
    EXPECT_TRUE(solution.converged) << solution.reason;
    EXPECT_LE(solution.iterations, 12);  // The paper: around 10.
    // The step that stopped was below 0.1 degrees, and steps shrink several times each.
    EXPECT_LT((solution.s - truth).head<3>().norm(), 0.1) << solution.s.transpose();
    EXPECT_LT((solution.s - truth).tail<3>().norm(), 0.002) << solution.s.transpose();
  }
}

TEST(PaperMethod, HeadPhantomConvergesFromThePapersStarts) {
  const Experiment made = experiment(headPhantom(5.0), 48, 1.0);
  const auto engine = makePaperEngineOpenCl(std::make_shared<Device>());
  PaperOptions options;
  options.stop_norm = 0.8;
  for (const double size : {2.0, 6.0}) {
    const PaperParameters truth = six(size, size);
    aim(engine.get(), made, truth);
    const PaperSolution solution = solvePaper(engine.get(), made.problem, options);
    EXPECT_TRUE(solution.converged) << solution.reason;
    // ‖Δs‖ < 0.8 stops; what remains after such a step is a fraction of it.
    EXPECT_LT((solution.s - truth).norm(), 0.4) << solution.s.transpose();
  }
}

TEST(PaperMethod, GainAndOffsetAreFoundAndDoNotMoveThePose) {
  Experiment made = experiment(headPhantom(5.0), 48, 1.0);
  made.problem.line_integrals = true;
  const auto engine = makePaperEngineOpenCl(std::make_shared<Device>());
  PaperOptions options;
  options.stop_norm = 0.02;
  options.gain_and_offset = true;
  const PaperParameters truth = six(2.0, 2.0);
  aim(engine.get(), made, truth, 0.7F, 0.4F);
  const PaperSolution solution = solvePaper(engine.get(), made.problem, options);
  EXPECT_TRUE(solution.converged) << solution.reason;
  EXPECT_NEAR(solution.gain, 0.7, 0.01);
  EXPECT_NEAR(solution.offset, 0.4, 0.02);
  EXPECT_LT((solution.s - truth).norm(), 0.05) << solution.s.transpose();

  // A brighter X-ray where the DRR is darker is no X-ray of this CT.
  aim(engine.get(), made, truth, -0.7F, 4.0F);
  const PaperSolution inverted = solvePaper(engine.get(), made.problem, options);
  EXPECT_FALSE(inverted.converged);
  EXPECT_FALSE(inverted.reason.empty());
}

/// Random columns and right side, as sums.
PaperMoments randomMoments(Eigen::MatrixXd* columns) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  *columns = Eigen::MatrixXd::NullaryExpr(200, 9, [&] { return normal(random); });
  columns->col(7).setOnes();
  columns->col(6).array() += 3.0;
  return columns->transpose() * *columns;
}

TEST(PaperStep, SolvesTheNormalEquations) {
  Eigen::MatrixXd z;
  const PaperMoments moments = randomMoments(&z);
  const Eigen::VectorXd expected = z.leftCols<6>().colPivHouseholderQr().solve(z.col(8));
  EXPECT_TRUE(paperStep(moments, false).delta.isApprox(expected, 1e-9));
}

TEST(PaperStep, EliminatesGainAndOffsetExactly) {
  Eigen::MatrixXd z;
  const PaperMoments moments = randomMoments(&z);
  // g − f = A y + β f + c in one least-squares problem of eight unknowns.
  const Eigen::VectorXd all = z.leftCols<8>().colPivHouseholderQr().solve(z.col(8));
  const PaperStep step = paperStep(moments, true);
  EXPECT_NEAR(step.gain, 1.0 + all[6], 1e-9);
  EXPECT_NEAR(step.offset, all[7], 1e-9);
  EXPECT_TRUE((step.delta * step.gain).isApprox(all.head<6>(), 1e-9));
}

TEST(PaperStep, SingularOrNotFiniteIsRefused) {
  Eigen::MatrixXd z;
  randomMoments(&z);
  z.col(4) = 2.0 * z.col(1);
  EXPECT_FALSE(paperStep(z.transpose() * z, false).reason.empty());
  EXPECT_FALSE(paperStep(z.transpose() * z, true).reason.empty());
  PaperMoments moments = randomMoments(&z);
  moments(2, 3) = std::nan("");
  EXPECT_FALSE(paperStep(moments, false).reason.empty());
  EXPECT_FALSE(paperStep(PaperMoments::Zero(), true).reason.empty());
}

TEST(PaperMethod, AnEmptyVolumeFixesNothingAndIsRefused) {
  Experiment made = experiment(whiteCube(24), 24, 1.0);
  std::fill(made.volume.values.begin(), made.volume.values.end(), std::uint16_t{0});
  const auto engine = makePaperEngineCpp();
  aim(engine.get(), made, six(1.0, 1.0));
  const PaperSolution solution = solvePaper(engine.get(), made.problem, {});
  EXPECT_FALSE(solution.converged);
  EXPECT_FALSE(solution.reason.empty());
  EXPECT_TRUE(solution.T_camera_ct.isApprox(made.problem.T_camera_ct_start));
}

TEST(PaperMethod, AStartOutsideTheImageIsRefused) {
  Experiment made = experiment(headPhantom(8.0), 24, 1.0);
  const auto engine = makePaperEngineCpp();
  aim(engine.get(), made, six(0.0, 0.0));
  made.problem.T_camera_ct_start.translation().x() += 2000.0;
  PaperSolution solution = solvePaper(engine.get(), made.problem, {});
  EXPECT_TRUE(solution.left_image);
  EXPECT_FALSE(solution.converged);
  made.problem.T_camera_ct_start.translation() = Eigen::Vector3d(0.0, 0.0, -3000.0);  // Behind the source.
  solution = solvePaper(engine.get(), made.problem, {});
  EXPECT_TRUE(solution.left_image);
}

TEST(PaperMethod, FiniteDifferencesAgreeWithHalfTheirStep) {
  const Experiment made = experiment(headPhantom(4.0), 64, 1.0);
  const auto engine = makePaperEngineCpp();
  aim(engine.get(), made, six(0.0, 0.0));
  const auto column = [&](int parameter, double step) {
    const auto image = [&](double at) {
      PaperParameters s = PaperParameters::Zero();
      s[parameter] = at;
      engine->render(
          1, paperRays(engine->grid(), made.problem.camera, paperPose(made.problem, s), made.problem.samples, false));
      const FloatImage read = engine->read(1);
      return Eigen::VectorXf::Map(read.pixels.data(), static_cast<Eigen::Index>(read.pixels.size())).eval();
    };
    return ((image(step) - image(0.0)) / static_cast<float>(step)).eval();
  };
  for (int parameter = 0; parameter < 6; ++parameter) {
    const Eigen::VectorXf whole = column(parameter, 0.5);
    const Eigen::VectorXf half = column(parameter, 0.25);
    // The second-order term of half a pixel's motion; a wrong parameter or sign would differ by 1 or 2.
    EXPECT_LT((whole - half).norm(), 0.25F * half.norm()) << parameter;
    EXPECT_GT(half.norm(), 0.0F);
  }
}

}  // namespace
}  // namespace xray_registration
