#include "registration/body_objective.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "xray_registration/drr/window_evidence.h"

namespace xray_registration {
namespace {

/// Vectors of the tiles: 1, DRR with all that surrounds the body, X-ray, six derivatives, the body's part of the DRR.
constexpr Eigen::Index kSum = 1;
constexpr Eigen::Index kXray = 2;
constexpr Eigen::Index kDerivatives = 3;
constexpr Eigen::Index kBody = 9;

/// Deviations, line integrals: what the X-ray is at least uncertain by, and below which a DRR is flat.
constexpr double kNoise = 0.005;
constexpr double kFlat = 0.002;
/// Windows whose errors go together, since what the CT does not know is larger than they are.
constexpr double kAlike = 4.0;
/// A window finds the body by itself when its residual's variance falls by a sixth: partial correlation 0.4.
constexpr double kInlierGain = 0.84;

using RowOfSix = Eigen::Matrix<double, 1, 6>;

/// What is not explained by the surroundings: everything of a window cleared of C by regression.
class Cleared {
 public:
  explicit Cleared(const WindowCovariance& c) {
    const double around = c(kSum, kSum) - 2.0 * c(kSum, kBody) + c(kBody, kBody);
    const double inverse = 1.0 / (std::max(around, 0.0) + kFlat * kFlat);
    const double x = c(kSum, kXray) - c(kBody, kXray);
    const double b = c(kSum, kBody) - c(kBody, kBody);
    const RowOfSix g = c.block<1, 6>(kSum, kDerivatives) - c.block<1, 6>(kBody, kDerivatives);
    xray = c(kXray, kXray) - x * x * inverse + kNoise * kNoise;
    body = std::max(c(kBody, kBody) - b * b * inverse, 0.0);
    xray_body = c(kXray, kBody) - x * b * inverse;
    by_xray = c.block<1, 6>(kXray, kDerivatives) - x * inverse * g;
    by_body = c.block<1, 6>(kBody, kDerivatives) - b * inverse * g;
    by_both = c.block<6, 6>(kDerivatives, kDerivatives) - inverse * g.transpose() * g;
  }

  double xray = 0.0;  ///< Variances and covariances.
  double body = 0.0;
  double xray_body = 0.0;
  RowOfSix by_xray;
  RowOfSix by_body;
  Matrix6d by_both;
};

void addWindow(double pixels, const Cleared& w, StepSums* sums) {
  if (!(w.body > kFlat * kFlat)) return;
  sums->content += pixels;
  const double factor = w.xray_body / (w.body + kFlat * kFlat);  // c
  if (!(factor > 0.0)) return;  // A body does not make an X-ray brighter: nothing is gained here.
  const double left = w.xray - factor * w.xray_body;
  const double gain = left / w.xray;
  sums->cost += 0.5 * pixels * std::log(gain);
  if (gain < kInlierGain) sums->inlier_fraction += pixels;
  // Of the residual X − a − bC − cB by the pose, through B alone: a, b, c are at their best.
  const Twist gradient = -pixels * factor / left * (w.by_xray - factor * w.by_body).transpose();
  const double curvature = pixels * factor * factor / left;
  const Matrix6d matrix = curvature * (w.by_both - w.by_body.transpose() * w.by_body / (w.body + kFlat * kFlat));
  sums->gradient += gradient;
  sums->matrix += matrix;
  sums->scatter += gradient * gradient.transpose();
}

/// √(1 − exp(−2 Λ/n)).
double similarityOf(const StepSums& sums) {
  return std::sqrt(std::max(1.0 - std::exp(2.0 * sums.cost / sums.content), 0.0));
}

void addView(const StepSums& sums, const Matrix6d& twist_carried, StepSums* total) {
  total->cost += sums.cost;
  total->content += sums.content;
  total->inlier_fraction += sums.inlier_fraction;
  total->gradient += twist_carried.transpose() * sums.gradient;
  total->matrix += twist_carried.transpose() * sums.matrix * twist_carried;
  total->scatter += twist_carried.transpose() * sums.scatter * twist_carried;
}

}  // namespace

StepSums BodyObjective::evaluateView(const DeviceViews::View& view, const Stage& stage,
                                     const RigidTransform& T_camera_body) {
  views().drawSurroundings(view, stage.level);
  const RigidTransform T_view_body = view.T_view_first * T_camera_body;
  const XrayCamera& camera = view.level(stage.level).camera;
  const TileProducts products =
      engine()->addUpBody(view.xray.get(), stage.level, views().volumeLevel(camera, T_view_body), T_view_body);
  StepSums sums;
  forEachWindowCovariance(products, stage.span, [&sums](double pixels, const WindowCovariance& covariance) {
    addWindow(pixels, Cleared(covariance), &sums);
  });
  return sums;
}

/// Each pixel stands in span² windows, and windows err alike, so the X-rays' matrix counts what they know so often; the
/// prior keeps step with it.
void BodyObjective::addPrior(const Stage& stage, const RigidTransform& T_camera_body, StepSums* sums) const {
  const Twist motion = twistBetween(T_camera_neutral_, T_camera_body, T_camera_neutral_ * views().centreCt());
  const double counted = kAlike * stage.span * stage.span;
  Twist weight;
  weight.head<3>().setConstant(counted / (sigma_mm_ * sigma_mm_));
  weight.tail<3>().setConstant(counted / (sigma_rad_ * sigma_rad_));
  sums->cost += 0.5 * motion.dot(weight.cwiseProduct(motion));
  sums->gradient += weight.cwiseProduct(motion);
  sums->matrix.diagonal() += weight;
  // The prior's own variance, of a term that covarianceOf() takes span² times.
  sums->scatter.diagonal() += kAlike * weight;
}

std::vector<double> BodyObjective::similarityOfViews(const Stage& stage, const RigidTransform& T_camera_body) {
  std::vector<double> similarities;
  if (!drawStep()) return similarities;
  for (const DeviceViews::View& view : views().views()) {
    const StepSums sums = evaluateView(view, stage, T_camera_body);
    if (sums.content > 0.0) similarities.push_back(similarityOf(sums));
  }
  return similarities;
}

StepSums BodyObjective::evaluateOne(const Stage& stage, const RigidTransform& T_camera_body) {
  StepSums total;
  for (const DeviceViews::View& view : views().views()) {
    addView(evaluateView(view, stage, T_camera_body), view.twist_carried, &total);
  }
  total.weight = total.content;
  if (total.content > 0.0) {
    total.similarity = similarityOf(total);
    total.inlier_fraction /= total.content;
    addPrior(stage, T_camera_body, &total);
  }
  return total;
}

GaussNewtonOptions BodyObjective::solverFor(const Stage& stage, const RigidTransform& start) const {
  GaussNewtonOptions solver = FrameObjective::solverFor(stage, start);
  solver.radius_mm = std::min(solver.radius_mm, engine()->volume().radiusMm());
  return solver;
}

std::vector<StepSums> BodyObjective::evaluate(const Stage& stage, double /*robust_scale2*/,
                                              const std::vector<RigidTransform>& T_camera_body) {
  std::vector<StepSums> all;
  for (const RigidTransform& pose : T_camera_body) {
    if (!drawStep()) return {};
    all.push_back(evaluateOne(stage, pose));
  }
  return all;
}

}  // namespace xray_registration
