#include "xray_registration/registration/fast_registrar.h"

#include "registration/cold_start.h"
#include "registration/discrete_check.h"
#include "registration/fast_wide_search.h"
#include "registration/frame_checks.h"
#include "registration/judgement.h"
#include "registration/moving_bodies.h"
#include "registration/setup_check.h"
#include "registration/tracked_frame.h"
#include "registration/tracking_level.h"
#include "xray_registration/common/stopwatch.h"
#include "xray_registration/drr/self_test.h"
#include "xray_registration/volume/volume_pyramid.h"

namespace xray_registration {
namespace {

/// Views are not cropped to a place.
constexpr double kAnywhereMm = 1.0e4;

}  // namespace

FastRegistrar::FastRegistrar(std::shared_ptr<Device> device, const RegistrarOptions& options, const Logger& logger)
    : device_(std::move(device)),
      options_(options),
      logger_(logger),
      engine_(makeEngineOpenCl(device_)),
      views_(std::make_unique<DeviceViews>(engine_.get())),
      setup_check_(std::make_unique<SetupCheck>()) {}

FastRegistrar::~FastRegistrar() = default;

void FastRegistrar::forget() {
  found_.reset();
  if (bodies_) bodies_->forget();
  setup_check_->forget();
  suspicions_.clear();
}

bool FastRegistrar::setOptions(const RegistrarOptions& options) {
  if (options.method != Method::kFast) return false;
  if (!solvesAlike(options, options_)) forget();
  options_ = options;
  return true;
}

void FastRegistrar::setVolume(const AttenuationVolume& volume) {
  bodies_.reset();
  forget();
  selfTest(engine_.get());
  warmUp(engine_.get(), options_.similarity);
  const std::size_t budget = residentVoxelBytes(*device_);
  if (volume.values.size() * sizeof(std::uint16_t) > budget) {
    engine_->setVolume(fittedTo(volume, budget, logger_));
  } else {
    engine_->setVolume(volume);
  }
  log(logger_, LogLevel::kInfo,
      "CT on " + device_->name() + ": " + std::to_string(engine_->volume().levels().size()) + " levels, " +
          std::to_string(engine_->volume().bytes() >> 20U) + " MiB");
}

void FastRegistrar::setBodies(const AttenuationVolume& rest, const std::vector<BodyModel>& bodies) {
  forget();
  bodies_.reset();
  if (!bodies.empty()) bodies_ = std::make_unique<MovingBodies>(engine_.get(), rest, bodies);
}

std::string FastRegistrar::problemOf(const std::vector<ViewInput>& views,
                                     const RigidTransform& T_camera_ct_start) const {
  if (!hasVolume()) return "no CT is loaded";
  std::string problem = xray_registration::problemOf(views, T_camera_ct_start);
  if (problem.empty() && !((T_camera_ct_start * centreCt()).z() > 0.0)) {
    problem = "the start pose puts the CT behind the X-ray source";
  }
  return problem;
}

RegistrationResult FastRegistrar::registerFrame(const std::vector<ViewInput>& inputs,
                                                const RigidTransform& T_camera_ct_start, bool tracking) {
  return registerFrom(inputs, {T_camera_ct_start}, tracking);
}

RegistrationResult FastRegistrar::registerAmong(const std::vector<ViewInput>& inputs,
                                                const std::vector<RigidTransform>& T_camera_ct_starts) {
  return registerFrom(inputs, T_camera_ct_starts, false);
}

std::unique_ptr<WideSearch> FastRegistrar::searchWidely(const std::vector<ViewInput>& inputs,
                                                        const WideSearchRange& range) {
  if (!hasVolume() || inputs.empty()) return nullptr;
  return std::make_unique<FastWideSearch>(engine_.get(), inputs, options_, range);
}

RegistrationResult FastRegistrar::registerFrom(const std::vector<ViewInput>& inputs,
                                               const std::vector<RigidTransform>& starts, bool tracking) {
  const Stopwatch watch;
  const RigidTransform& T_camera_ct_start = starts.front();
  RegistrationResult result;
  result.T_camera_ct = T_camera_ct_start;
  result.reason = problemOf(inputs, T_camera_ct_start);
  if (!result.reason.empty()) return result;
  result.solved = true;

  const bool tracked = tracking && found_;
  views_->upload(inputs, T_camera_ct_start, options_.max_image_pixels,
                 starts.size() > 1 ? kAnywhereMm : reachMm(tracked), tracked ? found_->levels_to_spare : 0);
  if (options_.saturation > 0.0) views_->setSaturation(options_.saturation);
  result.upload_ms = watch.milliseconds();

  StepBudget budget(options_.max_steps_per_frame);
  FrameObjective objective(engine_.get(), views_.get(), options_, &budget);
  SolveHistory history;
  history.T_camera_ct_start = T_camera_ct_start;
  history.predicted = tracking;
  history.searched = !tracking || !found_;
  Solution solution;
  if (!history.searched) {
    solution = track(T_camera_ct_start, &budget);
    history.found_similarity = found_->similarity;
    history.found_inlier_fraction = found_->inlier_fraction;
  } else {
    const ColdStartResult cold = startCold(&objective, starts);
    solution = cold.solution;
    // Where a wide search begins to look closer bounds nothing.
    if (starts.size() > 1) history.T_camera_ct_start = solution.T_camera_ct;
    history.confirmation = cold.confirmation;
    found_ = std::make_unique<ColdStart>(cold.found);
  }
  history.exceeded_steps = budget.exceeded() ? budget.allowed() : 0;
  judge(*views_, solution, history, options_, &result);
  if (history.searched) checkSides(inputs, T_camera_ct_start, solution, &result);
  checkSetup(inputs, solution, history.searched, &budget, &result);
  if (!result.accepted && history.searched) forget();  // A refused cold start teaches nothing.
  if (result.accepted) spareLevels(&objective, solution, history.searched);

  solution_ = std::make_unique<Solution>(solution);
  result.iterations = budget.used();
  result.solve_ms = watch.milliseconds();
  return result;
}

double FastRegistrar::reachMm(bool tracked) const {
  // A search ends up to one and a half times its range away; a prediction is off by what a frame's jerk may be.
  constexpr double kBeyondSearch = 1.5;
  constexpr double kJerkMm = 15.0;
  constexpr double kJerkRad = 0.1;
  const double radius_mm = engine_->volume().radiusMm();
  if (tracked) return kJerkMm + kJerkRad * radius_mm;
  if (!options_.search) return 2.0 * kJerkMm + 2.0 * kJerkRad * radius_mm;
  return kBeyondSearch * (options_.search_translation_mm + options_.search_rotation_rad * radius_mm);
}

void FastRegistrar::spareLevels(FrameObjective* objective, const Solution& solution, bool searched) {
  if (bodies_) return;  // A body is smaller, and needs all there is.
  const double precision_mm = options_.tracking_precision_mm;
  if (searched) {
    found_->levels_to_spare = levelsToSpare(objective, solution, precision_mm);
  } else if (found_->levels_to_spare > 0) {
    // The beam may have become weaker since.
    constexpr double kNoLonger = 2.0;
    const Matrix6d covariance = covarianceOf(solution.sums, finestSpan(options_.similarity));
    if (inPlaneSigma(covariance, solution.T_camera_ct) > kNoLonger * precision_mm) --found_->levels_to_spare;
  }
}

Solution FastRegistrar::track(const RigidTransform& T_camera_ct_start, StepBudget* budget) {
  Engine* engine = bodies_ ? bodies_->restEngine() : engine_.get();
  DeviceViews* views = bodies_ ? bodies_->viewsOfRest(*views_, T_camera_ct_start) : views_.get();
  TrackedObjective objective(engine, views, options_, budget);
  return trackFrame(&objective, *found_, T_camera_ct_start);
}

std::vector<BodyResult> FastRegistrar::registerBodies(const std::vector<BodyStart>& starts, RegistrationResult* rest) {
  if (!bodies_ || !solution_ || !rest->accepted) return {};
  const Stopwatch watch;
  std::vector<BodyResult> results = bodies_->registerIn(*views_, starts, options_, solution_.get());
  const Matrix6d considered =
      options_.check_every > 0 ? setup_check_->consideredCovariance(options_.setup) : Matrix6d(Matrix6d::Zero());
  describe(*solution_, finestSpan(options_.similarity), rest);
  rest->covariance += considered;
  for (BodyResult& body : results) {
    const Matrix6d carried = twistMovedBy(rest->T_camera_ct.linear() * (body.centre_ct_mm - centreCt()));
    body.covariance += carried * considered * carried.transpose();
    rest->iterations += body.iterations;
  }
  rest->solve_ms += watch.milliseconds();
  return results;
}

void FastRegistrar::checkSides(const std::vector<ViewInput>& inputs, const RigidTransform& T_camera_ct_start,
                               const Solution& solution, RegistrationResult* result) {
  if (options_.check_every == 0) return;
  const bool found = result->accepted;
  DiscreteOpinion opinion = checkDiscrete(engine_.get(), inputs, T_camera_ct_start, solution, found, options_);
  result->suspicions = std::move(opinion.suspicions);
  if (opinion.refusal.empty()) return;
  result->reason = found ? opinion.refusal : opinion.refusal + " (as told: " + result->reason + ")";
  result->accepted = false;
}

void FastRegistrar::checkSetup(const std::vector<ViewInput>& inputs, const Solution& solution, bool searched,
                               StepBudget* budget, RegistrationResult* result) {
  if (options_.check_every == 0) return;
  if (result->accepted && (searched || --frames_until_check_ <= 0)) {
    std::vector<std::string> names;
    names.reserve(inputs.size());
    for (const ViewInput& input : inputs) names.push_back(input.name);
    if (searched) setup_check_->forget();
    views_->weigh(found_->leave_out_unexplained, solution.T_camera_ct);  // On all tiles.
    if (bodies_) bodies_->leaveOutOf(views_.get(), solution.T_camera_ct);
    SetupObjective objective(engine_.get(), views_.get(), budget);
    SetupOpinion opinion = setup_check_->look(&objective, solution, names, options_.accept);
    suspicions_ = std::move(opinion.suspicions);
    result->reason = std::move(opinion.refusal);
    result->accepted = result->reason.empty();
    // While in doubt every frame is looked at.
    frames_until_check_ = result->accepted ? options_.check_every : 0;
  }
  result->suspicions.insert(result->suspicions.end(), suspicions_.begin(), suspicions_.end());
  result->covariance += setup_check_->consideredCovariance(options_.setup);
}

FloatImage FastRegistrar::renderDrr(const XrayCamera& camera, const RigidTransform& T_camera_ct) {
  return engine_->render(camera, 0, T_camera_ct);
}

std::vector<FloatImage> FastRegistrar::renderParts(const XrayCamera& camera, const RigidTransform& T_camera_ct,
                                                   const std::vector<RigidTransform>& T_camera_bodies) {
  if (!bodies_) return {renderDrr(camera, T_camera_ct)};
  return bodies_->render(camera, T_camera_ct, T_camera_bodies);
}

}  // namespace xray_registration
