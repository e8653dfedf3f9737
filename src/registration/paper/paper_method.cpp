#include "xray_registration/registration/paper/paper_method.h"

#include <Eigen/LU>
#include <cmath>

#include "xray_registration/common/stopwatch.h"

namespace xray_registration {
namespace {

constexpr double kRadiansPerDegree = 0.017453292519943295;
Eigen::Matrix3d eulerRotation(const Eigen::Vector3d& degrees) {
  const Eigen::Vector3d rad = degrees * kRadiansPerDegree;
  return (Eigen::AngleAxisd(rad.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rad.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rad.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

/// Gaussian elimination with pivoting on the matrix scaled to a unit diagonal, so that units do not decide what counts
/// as singular. False when it is.
template <typename Matrix, typename Vector>
bool eliminate(const Matrix& matrix, const Vector& right, Vector* solution) {
  if (!matrix.allFinite() || !right.allFinite() || !(matrix.diagonal().array() > 0.0).all()) return false;
  const Vector scale = matrix.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  Eigen::FullPivLU<Matrix> elimination(scaled);
  elimination.setThreshold(1e-7);  // Sums of floats: below this a pivot is rounding.
  if (!elimination.isInvertible()) return false;
  *solution = scale.asDiagonal() * elimination.solve(scale.asDiagonal() * right);
  return solution->allFinite();
}

/// One evaluation of all seven images at s.
PaperMoments evaluate(PaperEngine* engine, const PaperProblem& problem, const PaperOptions& options,
                      const PaperParameters& s, PaperSolution* solution) {
  std::array<double, 6> steps{};
  for (std::size_t k = 0; k < 6; ++k) steps[k] = k < 3 ? options.rotation_step_deg : options.translation_step;
  const Stopwatch watch;
  for (int slot = 0; slot < kPaperSlots; ++slot) {
    PaperParameters moved = s;
    if (slot > 0) moved[slot - 1] += steps[static_cast<std::size_t>(slot - 1)];
    engine->render(slot, paperRays(engine->grid(), problem.camera, paperPose(problem, moved), problem.samples,
                                   problem.line_integrals));
  }
  if (options.time_parts) engine->finish();
  solution->drr_ms += watch.milliseconds();
  return engine->moments(steps);
}

}  // namespace

RigidTransform paperPose(const PaperProblem& problem, const PaperParameters& s) {
  const Eigen::Vector3d centre = problem.T_camera_ct_start * problem.centre_ct_mm;
  const Eigen::Matrix3d rotation = eulerRotation(s.head<3>());
  RigidTransform pose = RigidTransform::Identity();
  pose.linear() = rotation * problem.T_camera_ct_start.linear();
  pose.translation() =
      rotation * (problem.T_camera_ct_start.translation() - centre) + centre + problem.unit_mm * s.tail<3>();
  return pose;
}

PaperStep paperStep(const PaperMoments& moments, bool gain_and_offset) {
  PaperStep step;
  if (!moments.allFinite()) {
    step.reason = "the sums of the normal equations are not finite";
    return step;
  }
  Matrix6d normal = moments.topLeftCorner<6, 6>();
  PaperParameters right = moments.block<6, 1>(0, 8);
  if (gain_and_offset) {
    // g − f = A y + β f + c with y = gain Δs and gain = 1 + β: linear, so the elimination is exact.
    const Eigen::Matrix2d inner = moments.block<2, 2>(6, 6);
    const Eigen::Vector2d inner_right = moments.block<2, 1>(6, 8);
    const Eigen::Matrix<double, 6, 2> coupling = moments.block<6, 2>(0, 6);
    Eigen::Matrix2d inverse;
    bool invertible = false;
    inner.computeInverseWithCheck(inverse, invertible, 1e-9 * inner(0, 0) * inner(1, 1));
    if (!invertible) {
      step.reason = "the DRR is empty or constant: the pose leaves the image";
      return step;
    }
    normal -= coupling * inverse * coupling.transpose();
    right -= coupling * inverse * inner_right;
    PaperParameters y;
    if (!eliminate(normal, right, &y)) {
      step.reason = "the normal equations are singular: the image does not fix the pose";
      return step;
    }
    const Eigen::Vector2d gain_offset = inverse * (inner_right - coupling.transpose() * y);
    step.gain = 1.0 + gain_offset[0];
    step.offset = gain_offset[1];
    if (!(step.gain > 1e-6)) {
      step.reason = "the X-ray gets brighter where the DRR gets darker: wrong image kind or wrong pose";
      return step;
    }
    step.delta = y / step.gain;
    step.normal = normal * step.gain * step.gain;
    return step;
  }
  step.normal = normal;
  if (!eliminate(normal, right, &step.delta)) {
    step.reason = "the normal equations are singular: the image does not fix the pose";
  }
  return step;
}

bool centreInView(const XrayCamera& camera, const RigidTransform& T_camera_ct, const Eigen::Vector3d& centre_ct_mm) {
  const Eigen::Vector3d centre = T_camera_ct * centre_ct_mm;
  if (!centre.allFinite() || !(centre.z() > 1.0)) return false;
  const Eigen::Vector2d pixel = camera.project(centre);
  return pixel.x() > -0.5 && pixel.y() > -0.5 && pixel.x() < camera.width - 0.5 && pixel.y() < camera.height - 0.5;
}

namespace {

/// g − gain f − offset from the sums, as a root mean square.
double residualOf(const PaperMoments& m, const PaperStep& step) {
  const double beta = step.gain - 1.0;
  const double c = step.offset;
  const double sum = m(8, 8) - 2.0 * (beta * m(6, 8) + c * m(7, 8)) + beta * beta * m(6, 6) + 2.0 * beta * c * m(6, 7) +
                     c * c * m(7, 7);
  return m(7, 7) > 0.0 ? std::sqrt(std::max(sum, 0.0) / m(7, 7)) : 0.0;
}

}  // namespace

PaperSolution solvePaper(PaperEngine* engine, const PaperProblem& problem, const PaperOptions& options) {
  PaperSolution solution;
  solution.T_camera_ct = problem.T_camera_ct_start;
  if (!centreInView(problem.camera, problem.T_camera_ct_start, problem.centre_ct_mm)) {
    solution.left_image = true;
    solution.reason = "the start lies outside the image";
    return solution;
  }
  const Stopwatch watch;
  while (solution.iterations < options.max_iterations && !solution.converged) {
    const PaperMoments moments = evaluate(engine, problem, options, solution.s, &solution);
    const PaperStep step = paperStep(moments, options.gain_and_offset);
    solution.finite = moments.allFinite();
    if (!step.reason.empty()) {
      solution.reason = step.reason;
      break;
    }
    solution.gain = step.gain;
    solution.offset = step.offset;
    solution.normal = step.normal;
    solution.allowed_pixels = moments(7, 7);
    solution.residual = residualOf(moments, step);
    const PaperParameters next = solution.s + step.delta;
    const RigidTransform pose = paperPose(problem, next);
    if (!centreInView(problem.camera, pose, problem.centre_ct_mm)) {
      solution.left_image = true;
      solution.reason = "the step was refused: the CT would leave the image";
      break;
    }
    solution.s = next;
    solution.T_camera_ct = pose;
    ++solution.iterations;
    solution.converged = step.delta.norm() < options.stop_norm;
  }
  solution.other_ms = watch.milliseconds() - solution.drr_ms;
  return solution;
}

}  // namespace xray_registration
