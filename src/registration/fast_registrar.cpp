#include "xray_registration/registration/fast_registrar.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "registration/frame_checks.h"
#include "registration/view_preparation.h"
#include "xray_registration/common/stopwatch.h"
#include "xray_registration/drr/self_test.h"
#include "xray_registration/registration/verdict.h"
#include "xray_registration/volume/volume_pyramid.h"

namespace xray_registration {
namespace {

/// Radius about the centre over which motion is measured: an organ's size.
constexpr double kTargetRadiusMm = 60.0;
/// How far beyond the CT's sphere a start may be off and its projection still be in the crop.
constexpr double kCropMarginMm = 15.0;
/// Line integral of unexplained tissue (5 cm of water) that halves a ray's weight.
constexpr double kUnexplainedLimit = 1.0;
/// Deviations below this part of the image's own count as flat.
constexpr double kFlatPart = 0.005;
/// Deviation, as part of the image's own, at which a window counts half.
constexpr double kContrastPart = 0.2;
constexpr double kNotRobust = 1e6;
/// Pixels of a whole image, in units of max_image_pixels, however small the CT's shadow in it is.
constexpr double kMostPixels = 50.0;
/// Share of the finest level's tiles that a tracked frame uses, and its evaluations there.
constexpr double kTrackedTiles = 0.65;
constexpr int kFinestTrackedSteps = 2;
/// Pixels of CT shadow that a level needs: half a dozen tiles, or windows hold more of the rest than of the CT.
constexpr double kSmallestShadow = 400.0;

/// A⁻¹ B A⁻¹ (P. J. Huber, 1967): A the curvature, B the variance of the gradient, from the scatter of the windows'
/// own gradients, so that noise, its correlation inside a window and model errors are all in it. Each tile stands in
/// span² windows, whose gradients therefore move together.
Matrix6d covarianceOf(const StepSums& sums, int span) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scaledToRadius(sums.matrix, kTargetRadiusMm));
  if (eigen.info() != Eigen::Success || !(eigen.eigenvalues()[0] > 0.0)) return Matrix6d::Zero();
  const Matrix6d scaled_inverse =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  const Matrix6d inverse = scaledToRadius(scaled_inverse, kTargetRadiusMm);
  const double overlap = std::max(1, span * span);
  // Gradients at the optimum are smaller than at the truth: six parameters were fitted to them (J. G. MacKinnon, H.
  // White, 1985). Tiles of 64 pixels are what is independent.
  const double tiles = std::max(sums.content / overlap / 64.0, 12.0);
  const double fitted = std::pow(tiles / (tiles - 6.0), 2);
  const Matrix6d covariance = inverse * (fitted * overlap * sums.scatter) * inverse;
  return 0.5 * (covariance + covariance.transpose());
}

/// Mean motion of points on the target sphere between two poses, in the camera's x and y.
double inPlaneDistance(const RigidTransform& a, const RigidTransform& b, const Eigen::Vector3d& centre_ct) {
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d target = centre_ct + side * kTargetRadiusMm * Eigen::Vector3d::Unit(axis);
      sum += (a * target - b * target).head<2>().norm();
    }
  }
  return sum / 6.0;
}

/// Adds a view's sums: the same motion in this camera's axes, so the normal equations come back by the transpose.
/// Similarity and inlier fraction are summed with the content as weight.
void addView(const StepSums& sums, const Matrix6d& twist_carried, StepSums* total) {
  total->matrix += twist_carried.transpose() * sums.matrix * twist_carried;
  total->gradient += twist_carried.transpose() * sums.gradient;
  total->scatter += twist_carried.transpose() * sums.scatter * twist_carried;
  total->cost += sums.cost;
  total->weight += sums.weight;
  total->similarity += sums.similarity * sums.content;
  total->inlier_fraction += sums.inlier_fraction * sums.content;
  total->content += sums.content;
}

/// Element `index` of the Halton sequence in `base`: fills the unit interval evenly, the same on every machine.
double halton(int index, int base) {
  double result = 0.0;
  double part = 1.0;
  for (; index > 0; index /= base) {
    part /= base;
    result += part * (index % base);
  }
  return result;
}

/// The point's pixel lies in the image or at most half an image beside it.
bool isInView(const Eigen::Vector3d& point_camera_mm, const XrayCamera& camera) {
  if (!(point_camera_mm.z() > 0.0)) return false;
  const Eigen::Vector2d pixel = camera.project(point_camera_mm);
  return pixel.x() > -0.5 * camera.width && pixel.x() < 1.5 * camera.width && pixel.y() > -0.5 * camera.height &&
         pixel.y() < 1.5 * camera.height;
}

/// A cost that can be compared: what is not finite comes last.
double orderedCost(const StepSums& sums) { return sums.finite() ? sums.cost : std::numeric_limits<double>::infinity(); }

/// Pixels with CT behind them.
double shadowPixels(const FloatImage& drr) {
  return static_cast<double>(
      std::count_if(drr.pixels.begin(), drr.pixels.end(), [](float value) { return value > 0.0F; }));
}

}  // namespace

FastRegistrar::FastRegistrar(std::shared_ptr<Device> device, const RegistrarOptions& options, const Logger& logger)
    : device_(std::move(device)), options_(options), logger_(logger), engine_(device_) {}

bool FastRegistrar::setOptions(const RegistrarOptions& options) {
  if (options.method != Method::kFast) return false;
  options_ = options;
  return true;
}

void FastRegistrar::setVolume(const AttenuationVolume& volume) {
  selfTest(&engine_);
  const std::size_t budget = residentVoxelBytes(*device_);
  if (volume.values.size() * sizeof(std::uint16_t) > budget) {
    engine_.setVolume(fittedTo(volume, budget, logger_));
  } else {
    engine_.setVolume(volume);
  }
  log(logger_, LogLevel::kInfo,
      "CT on " + device_->name() + ": " + std::to_string(engine_.volume().levels().size()) + " levels, " +
          std::to_string(engine_.volume().bytes() >> 20U) + " MiB");
}

int FastRegistrar::binningFor(const XrayCamera& whole, const RigidTransform& T_view_ct) {
  const double pixels = static_cast<double>(whole.width) * whole.height;
  if (pixels <= options_.max_image_pixels) return 1;
  // The march costs by the pixel that has CT behind it, so a small bone in a large image is seen finely.
  constexpr int kPreviewSide = 64;
  const int preview = std::max(1, std::min(whole.width, whole.height) / kPreviewSide);
  const XrayCamera camera = whole.binned(preview);
  const double depth_mm = depthOf(T_view_ct);
  const double shadow =
      shadowPixels(engine_.render(camera, volumeLevel(camera, T_view_ct), T_view_ct)) * preview * preview;
  // Nor is there anything to see far below the voxels' size, or in an image that takes longer to bin than to register.
  const double finest_useful_mm = 0.3 * engine_.volume().levels().front().spacing_mm;
  const double factor = std::max({std::sqrt(shadow / options_.max_image_pixels),
                                  std::sqrt(pixels / (kMostPixels * options_.max_image_pixels)),
                                  finest_useful_mm / whole.pixelSizeAt(depth_mm)});
  return std::max(1, static_cast<int>(std::ceil(factor - 1e-9)));
}

FastRegistrar::View FastRegistrar::uploadView(const ViewInput& view, const RigidTransform& T_camera_ct_start) {
  const RigidTransform T_view_ct = view.T_view_first * T_camera_ct_start;
  View on_device;
  on_device.T_view_first = view.T_view_first;
  on_device.twist_carried = twistCarriedBy(view.T_view_first);
  const PreparedView prepared =
      prepareView(*view.xray, T_view_ct * centreCt(), engine_.volume().radiusMm() + kCropMarginMm,
                  binningFor(view.xray->camera, T_view_ct));
  on_device.xray = engine_.upload(prepared.camera, prepared.attenuation, prepared.weight);
  return on_device;
}

int FastRegistrar::coarsestLevel(const std::vector<View>& views, const RigidTransform& T_camera_ct) {
  int coarsest = std::numeric_limits<int>::max();
  for (const View& view : views) {
    int level = static_cast<int>(view.xray.levels.size()) - 1;
    const RigidTransform T_view_ct = view.T_view_first * T_camera_ct;
    const XrayCamera& camera = view.level(level).camera;
    double pixels = shadowPixels(engine_.render(camera, volumeLevel(camera, T_view_ct), T_view_ct));
    for (; level > 0 && pixels < kSmallestShadow; --level) pixels *= 4.0;
    coarsest = std::min(coarsest, level);
  }
  return coarsest;
}

std::vector<FastRegistrar::Stage> FastRegistrar::stages(int coarsest) const {
  const int span = windowSpan();
  std::vector<Stage> stages;
  // The search has already been on the coarsest level.
  const int first = options_.search && coarsest > 1 ? coarsest - 1 : coarsest;
  for (int level = first; level >= 0; --level)
    stages.push_back({level, level == 0 ? finestSpan() : span, level == 0 ? 8 : 15});
  return stages;
}

double FastRegistrar::depthOf(const RigidTransform& T_camera_ct) const {
  return std::max((T_camera_ct * centreCt()).z(), 1.0);
}

int FastRegistrar::volumeLevel(const XrayCamera& camera, const RigidTransform& T_view_ct) const {
  return engine_.volume().levelFor(camera.pixelSizeAt(depthOf(T_view_ct)));
}

WindowOptions FastRegistrar::windowOptions(const View& view, const Stage& stage, double robust_scale2) const {
  WindowOptions window;
  window.span = stage.span;
  window.epsilon_value = kFlatPart;
  window.epsilon_xray = kFlatPart * view.xray.deviation;
  window.contrast = kContrastPart * view.xray.deviation;
  window.robust_scale2 = robust_scale2;
  return window;
}

StepSums FastRegistrar::evaluate(const std::vector<View>& views, const Stage& stage, double robust_scale2,
                                 const RigidTransform& T_camera_ct) {
  return evaluateMany(views, stage, robust_scale2, {T_camera_ct}).front();
}

std::vector<StepSums> FastRegistrar::evaluateMany(const std::vector<View>& views, const Stage& stage,
                                                  double robust_scale2,
                                                  const std::vector<RigidTransform>& T_camera_ct) {
  std::vector<StepSums> totals(T_camera_ct.size());
  for (const View& view : views) {
    std::vector<RigidTransform> T_view_ct;
    T_view_ct.reserve(T_camera_ct.size());
    for (const RigidTransform& pose : T_camera_ct) T_view_ct.push_back(view.T_view_first * pose);
    const ResidentXray::Level& xray = view.level(stage.level);
    const std::vector<StepSums> sums = engine_.evaluate(xray, volumeLevel(xray.camera, T_view_ct.front()), T_view_ct,
                                                        windowOptions(view, stage, robust_scale2));
    for (std::size_t i = 0; i < totals.size(); ++i) addView(sums[i], view.twist_carried, &totals[i]);
  }
  for (StepSums& total : totals) {
    if (!(total.content > 0.0)) continue;
    total.similarity /= total.content;
    total.inlier_fraction /= total.content;
  }
  return totals;
}

double FastRegistrar::robustScale(const std::vector<View>& views, const Stage& stage,
                                  const RigidTransform& T_camera_ct) {
  if (!options_.robust_weights || stage.span == 0) return kNotRobust;
  std::vector<float> errors;
  for (const View& view : views) {
    const ResidentXray::Level& xray = view.level(stage.level);
    const RigidTransform T_view_ct = view.T_view_first * T_camera_ct;
    engine_.evaluate(xray, volumeLevel(xray.camera, T_view_ct), {T_view_ct}, windowOptions(view, stage, kNotRobust));
    for (const float correlation : engine_.windowCorrelations()) {
      if (correlation >= -1.0F) errors.push_back(1.0F - correlation);
    }
  }
  if (errors.empty()) return kNotRobust;
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  // At three times the median a window keeps a quarter of its weight.
  return std::max(0.1, 3.0 * static_cast<double>(*middle));
}

bool FastRegistrar::weighViews(std::vector<View>* views, bool leave_out_unexplained,
                               const RigidTransform& T_camera_ct) {
  constexpr double kNoticed = 0.98;
  bool noticed = false;
  for (View& view : *views) {
    if (leave_out_unexplained) {
      noticed |= engine_.weighUnexplained(&view.xray, view.T_view_first * T_camera_ct, kUnexplainedLimit) < kNoticed;
    } else {
      engine_.restoreWeights(&view.xray);
    }
  }
  return noticed;
}

GaussNewtonOptions FastRegistrar::solverFor(const std::vector<View>& views, const Stage& stage,
                                            const RigidTransform& start) const {
  const double depth_mm = depthOf(start);
  const double pixel_mm = views.front().level(stage.level).camera.pixelSizeAt(depth_mm);
  GaussNewtonOptions solver;
  solver.max_steps = stage.max_steps;
  solver.radius_mm = kTargetRadiusMm;
  solver.depth_mm = depth_mm;
  // The last step of the finest level is taken untested, so it may be longer than what counts.
  solver.stop_mm = (stage.level == 0 ? 0.1 : 0.05) * pixel_mm;
  solver.max_untested_step_mm = stage.level == 0 ? 0.3 * pixel_mm : 0.0;
  return solver;
}

GaussNewtonResult FastRegistrar::solveStage(const std::vector<View>& views, const Stage& stage, double robust_scale2,
                                            const RigidTransform& start, int steps_left) {
  GaussNewtonOptions solver = solverFor(views, stage, start);
  solver.max_steps = std::max(1, std::min(solver.max_steps, steps_left));
  return minimise([&](const RigidTransform& pose) { return evaluate(views, stage, robust_scale2, pose); }, start,
                  centreCt(), solver);
}

RigidTransform FastRegistrar::searchAround(const std::vector<View>& views, const Stage& stage,
                                           const RigidTransform& start, int first_index, int* steps) {
  // Many poses ranked by cost, the best few refined side by side.
  constexpr std::size_t kRefined = 8;
  constexpr int kBases[6] = {2, 3, 5, 7, 11, 13};
  std::vector<RigidTransform> poses = {start};
  for (int i = first_index; i < first_index + options_.search_poses; ++i) {
    Twist offset;
    for (int axis = 0; axis < 6; ++axis) {
      const double range = axis < 3 ? options_.search_translation_mm : options_.search_rotation_rad;
      offset[axis] = range * (2.0 * halton(i, kBases[axis]) - 1.0);
    }
    poses.push_back(updatedPose(start, offset, start * centreCt()));
  }
  const std::vector<StepSums> ranked = evaluateMany(views, stage, kNotRobust, poses);
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), 0);
  // The start itself always takes part.
  std::stable_sort(order.begin() + 1, order.end(),
                   [&](std::size_t a, std::size_t b) { return orderedCost(ranked[a]) < orderedCost(ranked[b]); });
  std::vector<RigidTransform> best;
  for (std::size_t i = 0; i < std::min(kRefined, order.size()); ++i) best.push_back(poses[order[i]]);

  const std::vector<GaussNewtonResult> refined = minimiseMany(
      [&](const std::vector<RigidTransform>& batch) { return evaluateMany(views, stage, kNotRobust, batch); }, best,
      centreCt(), solverFor(views, stage, start));
  const auto winner = std::min_element(refined.begin(), refined.end(), [](const auto& a, const auto& b) {
    return orderedCost(a.sums) < orderedCost(b.sums);
  });
  *steps += winner->steps;
  return winner->T_camera_ct;
}

GaussNewtonResult FastRegistrar::descend(std::vector<View>* views, const std::vector<Stage>& plan, bool leave_out,
                                         const GaussNewtonResult& start, int* steps) {
  GaussNewtonResult solution = start;
  const int budget = *steps + options_.max_steps_per_frame;
  double robust_scale2 = start.robust_scale2;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    if (i > 0 && leave_out) weighViews(views, true, solution.T_camera_ct);
    if (i > 0) robust_scale2 = robustScale(*views, plan[i - 1], solution.T_camera_ct);
    const double coarser_similarity = solution.sums.similarity;
    solution = solveStage(*views, plan[i], robust_scale2, solution.T_camera_ct, budget - *steps);
    solution.robust_scale2 = robust_scale2;
    solution.coarser_similarity = coarser_similarity;
    *steps += solution.steps;
    if (solution.failed) break;
  }
  return solution;
}

GaussNewtonResult FastRegistrar::track(std::vector<View>* views, const RigidTransform& start, int* steps) {
  if (leave_out_unexplained_) weighViews(views, true, start);
  GaussNewtonResult solution;
  solution.T_camera_ct = start;
  // The tracked X-ray may be smaller than the one that the start was found in.
  int coarsest = coarsest_level_;
  for (const View& view : *views) coarsest = std::min(coarsest, static_cast<int>(view.xray.levels.size()) - 1);
  if (coarsest >= 1) {
    solution = solveStage(*views, {1, windowSpan(), 8}, robust_scale2_, start, options_.max_steps_per_frame);
    *steps += solution.steps;
    if (solution.failed) return solution;
    for (View& view : *views) engine_.keepContrastTiles(&view.xray.levels.front(), kTrackedTiles);
  }
  const double coarser_similarity = solution.sums.similarity;
  const int finest_steps = coarsest >= 1 ? kFinestTrackedSteps : 8;
  solution = solveStage(*views, {0, finestSpan(), finest_steps}, robust_scale2_, solution.T_camera_ct,
                        options_.max_steps_per_frame - *steps);
  solution.coarser_similarity = coarser_similarity;
  *steps += solution.steps;
  return solution;
}

FastRegistrar::Attempt FastRegistrar::attempt(std::vector<View>* views, int coarsest, bool leave_out,
                                              const RigidTransform& start, int first_index, int* steps) {
  Attempt attempt;
  attempt.leave_out = leave_out;
  attempt.noticed = weighViews(views, leave_out, start);
  GaussNewtonResult found;
  found.T_camera_ct = start;
  if (options_.search) {
    found.T_camera_ct = searchAround(*views, {coarsest, windowSpan(), 10}, start, first_index, steps);
    if (leave_out) attempt.noticed |= weighViews(views, true, found.T_camera_ct);
  }
  std::vector<Stage> plan = stages(coarsest);
  if (plan.size() > 1) plan.pop_back();
  attempt.solution = descend(views, plan, leave_out, found, steps);
  return attempt;
}

FastRegistrar::Attempt FastRegistrar::searchAndDescend(std::vector<View>* views, int coarsest,
                                                       const RigidTransform& start, int first_index, int* steps) {
  Attempt best = attempt(views, coarsest, options_.truncation_weights, start, first_index, steps);
  if (best.noticed) {
    // Whether the X-ray shows the cut as the CT does (a specimen, a phantom) or a body that goes on is not known
    // before: what matches better tells.
    const Attempt whole = attempt(views, coarsest, false, start, first_index, steps);
    if (!whole.solution.failed && whole.solution.sums.similarity > best.solution.sums.similarity) best = whole;
  }
  weighViews(views, best.leave_out, best.solution.T_camera_ct);
  const std::vector<Stage> plan = stages(coarsest);
  if (plan.size() > 1 && !best.solution.failed) {
    best.solution.robust_scale2 = robustScale(*views, plan[plan.size() - 2], best.solution.T_camera_ct);
    best.solution = descend(views, {plan.back()}, best.leave_out, best.solution, steps);
  }
  return best;
}

FastRegistrar::Attempt FastRegistrar::confirmedSearch(std::vector<View>* views, const RigidTransform& start,
                                                      double* disagreement_mm, int* steps) {
  // Other poses around the same start, and a finer level: a right answer is found twice, a wrong one rarely.
  constexpr int kMostAttempts = 4;
  std::vector<Attempt> attempts;
  std::size_t best = 0;
  for (int i = 0; i < kMostAttempts; ++i) {
    const int coarsest = i == 0 ? coarsest_level_ : std::max(coarsest_level_ - 1, 0);
    attempts.push_back(searchAndDescend(views, coarsest, start, 1 + i * options_.search_poses, steps));
    const GaussNewtonResult& latest = attempts.back().solution;
    if (!latest.failed && latest.likeness() > attempts[best].solution.likeness()) best = attempts.size() - 1;
    *disagreement_mm = -1.0;  // A sure result needs no second one.
    if (!options_.search || attempts[best].solution.likeness() >= options_.accept.sure_similarity) break;
    *disagreement_mm = std::numeric_limits<double>::max();
    for (std::size_t other = 0; other < attempts.size(); ++other) {
      if (other == best) continue;
      *disagreement_mm = std::min(*disagreement_mm, inPlaneDistance(attempts[best].solution.T_camera_ct,
                                                                    attempts[other].solution.T_camera_ct, centreCt()));
    }
    if (*disagreement_mm <= options_.accept.max_disagreement_mm) break;
  }
  return attempts[best];
}

RegistrationResult FastRegistrar::registerFrame(const std::vector<ViewInput>& inputs,
                                                const RigidTransform& T_camera_ct_start, bool tracking) {
  const Stopwatch watch;
  RegistrationResult result;
  result.T_camera_ct = T_camera_ct_start;
  if (!hasVolume()) {
    result.reason = "no CT is loaded";
    return result;
  }
  result.reason = problemOf(inputs, T_camera_ct_start);
  if (!result.reason.empty()) return result;
  if (!((T_camera_ct_start * centreCt()).z() > 0.0)) {
    result.reason = "the start pose puts the CT behind the X-ray source";
    return result;
  }

  result.solved = true;
  std::vector<View> views;
  views.reserve(inputs.size());
  for (const ViewInput& input : inputs) views.push_back(uploadView(input, T_camera_ct_start));
  result.upload_ms = watch.milliseconds();

  GaussNewtonResult solution;
  double disagreement_mm = -1.0;
  if (tracking) {
    solution = track(&views, T_camera_ct_start, &result.iterations);
  } else {
    coarsest_level_ = coarsestLevel(views, T_camera_ct_start);
    const Attempt found = confirmedSearch(&views, T_camera_ct_start, &disagreement_mm, &result.iterations);
    solution = found.solution;
    leave_out_unexplained_ = found.leave_out;
    robust_scale2_ = solution.robust_scale2;
  }
  judge(views, solution, T_camera_ct_start, tracking, disagreement_mm, &result);
  result.solve_ms = watch.milliseconds();
  return result;
}

void FastRegistrar::judge(const std::vector<View>& views, const GaussNewtonResult& solution,
                          const RigidTransform& start, bool tracking, double disagreement_mm,
                          RegistrationResult* result) {
  VerdictCues cues;
  cues.has_second_solve = disagreement_mm >= 0.0;
  cues.disagreement_mm = disagreement_mm;
  cues.finite = solution.sums.finite() && solution.T_camera_ct.matrix().allFinite();
  if (cues.finite) {
    result->T_camera_ct = solution.T_camera_ct;
    result->similarity = solution.likeness();
    result->inlier_fraction = solution.sums.inlier_fraction;
    result->condition_number = conditionNumber(solution.sums.matrix, kTargetRadiusMm);
    result->residual =
        solution.sums.weight > 0.0 ? std::sqrt(std::max(2.0 * solution.sums.cost / solution.sums.weight, 0.0)) : 0.0;
    result->covariance = covarianceOf(solution.sums, finestSpan());
  }
  result->converged = solution.converged;
  const Eigen::Vector3d centre = result->T_camera_ct * centreCt();
  cues.in_view = isInView(centre, views.front().level(0).camera);
  cues.converged = solution.converged && !solution.failed;
  cues.similarity = result->similarity;
  cues.inlier_fraction = result->inlier_fraction;
  cues.condition_number = result->condition_number;
  cues.tracking = tracking;
  // A search knows how far it looked; what the descent found far outside, and is not sure, is another optimum.
  if (!tracking && options_.search && cues.similarity < options_.accept.sure_similarity) {
    cues.search_range_mm = 2.0 * options_.search_translation_mm;
    cues.search_range_rad = 2.0 * options_.search_rotation_rad;
  }
  cues.jump_mm = (centre - start * centreCt()).norm();
  cues.jump_rad = rotationAngleBetween(result->T_camera_ct, start);
  AcceptOptions accept = options_.accept;
  if (views.size() == 1) {
    accept.min_similarity = std::max(accept.min_similarity, accept.min_similarity_one_view);
    accept.min_inlier_fraction = std::max(accept.min_inlier_fraction, accept.min_inlier_fraction_one_view);
  }
  result->reason = reasonToRefuse(cues, accept);
  result->accepted = result->reason.empty();
}

FloatImage FastRegistrar::renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) {
  return engine_.render(camera, 0, T_camera_ct);
}

}  // namespace xray_registration
