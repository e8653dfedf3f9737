#include "xray_registration/evaluation/trials.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "xray_registration/common/stopwatch.h"
#include "xray_registration/drr/device.h"
#include "xray_registration/evaluation/lost_trial.h"

namespace xray_registration {
namespace {

void check(const std::vector<EvaluationFrame>& frames) {
  if (frames.empty()) throw std::invalid_argument("no frame with a true pose to evaluate on");
  for (const EvaluationFrame& frame : frames) {
    if (frame.views.empty()) {
      throw std::invalid_argument("frame " + std::to_string(frame.index) + " has no view to evaluate on");
    }
  }
}

void check(const TrialOptions& options) {
  if (options.trials < 1) {
    throw std::invalid_argument("trials is " + std::to_string(options.trials) + "; at least 1 is needed");
  }
  const auto isRange = [](double value) { return std::isfinite(value) && value >= 0.0; };
  if (!isRange(options.range.rotation_rad) || !isRange(options.range.translation_mm)) {
    throw std::invalid_argument("rotation and translation of the starts must be finite and not negative");
  }
  if (!std::isfinite(options.target_size_mm) || options.target_size_mm <= 0.0) {
    throw std::invalid_argument("target size is " + std::to_string(options.target_size_mm) +
                                " mm; it must be positive");
  }
}

void addBodies(const RegistrationResult& result, const EvaluationFrame& frame, Trial* trial) {
  for (const BodyResult& body : result.bodies) {
    const auto truth = frame.T_camera_bodies_true.find(body.name);
    if (truth == frame.T_camera_bodies_true.end()) continue;
    BodyTrial entry;
    entry.result = body;
    entry.final = poseError(body.T_camera_body, truth->second, targetGrid(body.centre_ct_mm, kBodyTargetSizeMm));
    entry.final_rotation_rad = rotationAngleBetween(body.T_camera_body, truth->second);
    trial->bodies.push_back(entry);
  }
}

/// Starts of the bodies: a body that is cut out of the CT against the CT's start, one that has a CT of its own against
/// its truth, as the CT's own start is.
RegistrationPipeline::BodyPoses bodyStarts(const RegistrationPipeline& pipeline, const EvaluationFrame& frame,
                                           const RigidTransform& T_camera_ct_start, RandomStarts* starts,
                                           RandomStarts* body_starts) {
  RegistrationPipeline::BodyPoses poses;
  for (const FollowedBodyInfo& body : pipeline.followedBodies()) {
    RigidTransform T = T_camera_ct_start;
    if (!body.cut_from_ct) {
      const auto truth = frame.T_camera_bodies_true.find(body.name);
      if (truth == frame.T_camera_bodies_true.end()) continue;
      T = updatedPose(truth->second, starts->next(), truth->second * body.centre_mm);
    }
    poses[body.name] = updatedPose(T, body_starts->next(), T * body.centre_mm);
  }
  return poses;
}

/// Of the bodies with CTs of their own: nothing else says where these are.
RegistrationPipeline::BodyPoses ownTruths(const RegistrationPipeline& pipeline, const EvaluationFrame& frame) {
  RegistrationPipeline::BodyPoses poses;
  for (const FollowedBodyInfo& body : pipeline.followedBodies()) {
    const auto truth = frame.T_camera_bodies_true.find(body.name);
    if (!body.cut_from_ct && truth != frame.T_camera_bodies_true.end()) poses[body.name] = truth->second;
  }
  return poses;
}

/// What became of a frame that was registered from a start.
Trial trialOf(const FrameOutcome& outcome, const RigidTransform& T_camera_ct_start,
              const RegistrationPipeline& pipeline, const EvaluationFrame& frame, const Eigen::Vector3d& centre_ct_mm,
              double target_size_mm) {
  if (outcome.state == TrackingState::kFault) throw DeviceError("the device failed: " + pipeline.fault(), 0);
  Trial trial;
  trial.frame = frame.index;
  trial.stamp_s = frame.stamp_s;
  trial.disturbance = twistBetween(frame.T_camera_ct_true, T_camera_ct_start, frame.T_camera_ct_true * centre_ct_mm);
  trial.result = outcome.result;
  if (!outcome.registered) trial.result.T_camera_ct = T_camera_ct_start;
  trial.prepare_ms = outcome.prepare_ms;
  trial.solve_ms = outcome.total_ms - outcome.prepare_ms;
  const std::vector<Eigen::Vector3d> targets_ct_mm = targetGrid(centre_ct_mm, target_size_mm);
  addBodies(outcome.result, frame, &trial);
  trial.start = poseError(T_camera_ct_start, frame.T_camera_ct_true, targets_ct_mm);
  trial.final = poseError(trial.result.T_camera_ct, frame.T_camera_ct_true, targets_ct_mm);
  return trial;
}

/// The frame through the pipeline from where the pipeline stands.
Trial registerFrom(const RigidTransform& T_camera_ct_start, RegistrationPipeline* pipeline,
                   const EvaluationFrame& frame, const Eigen::Vector3d& centre_ct_mm, double target_size_mm) {
  const FrameOutcome outcome = pipeline->process(frame.stamp_s, frame.views);
  return trialOf(outcome, T_camera_ct_start, *pipeline, frame, centre_ct_mm, target_size_mm);
}

/// The direction and the axis of a disturbance with the range's whole length and angle.
Twist fullLength(const Twist& disturbance, const StartRange& range) {
  Twist full;
  full.head<3>() = range.translation_mm * disturbance.head<3>().normalized();
  full.tail<3>() = range.rotation_rad * disturbance.tail<3>().normalized();
  return full;
}

WideSearchRange rangeAround(const RigidTransform& T_camera_ct_start, const TrialOptions& options) {
  WideSearchRange range;
  if (options.kind == TrialKind::kFromNothing) return range;
  range.T_camera_ct_centre = T_camera_ct_start;
  range.rotation_rad = options.range.rotation_rad;
  range.translation_mm = options.range.translation_mm;
  return range;
}

}  // namespace

Trial runTrial(RegistrationPipeline* pipeline, const EvaluationFrame& frame, const Twist& disturbance,
               const Eigen::Vector3d& centre_ct_mm, double target_size_mm,
               const RegistrationPipeline::BodyPoses& T_camera_bodies) {
  const RigidTransform T_camera_ct_start =
      updatedPose(frame.T_camera_ct_true, disturbance, frame.T_camera_ct_true * centre_ct_mm);
  pipeline->reset();
  pipeline->setPose(T_camera_ct_start, T_camera_bodies);
  Trial trial = registerFrom(T_camera_ct_start, pipeline, frame, centre_ct_mm, target_size_mm);
  trial.disturbance = disturbance;
  return trial;
}

Trial localizeTrial(RegistrationPipeline* pipeline, const EvaluationFrame& frame, const WideSearchRange& range,
                    const Eigen::Vector3d& centre_ct_mm, double target_size_mm) {
  pipeline->reset();
  const Stopwatch watch;
  const std::string problem = pipeline->beginSearch(frame.stamp_s, frame.views, range);
  while (pipeline->advanceSearch()) {
  }
  FrameOutcome outcome = pipeline->finishSearch();
  if (!problem.empty()) outcome.result.reason = problem;
  outcome.total_ms = watch.milliseconds();
  const RigidTransform start = range.T_camera_ct_centre.value_or(RigidTransform::Identity());
  Trial trial = trialOf(outcome, start, *pipeline, frame, centre_ct_mm, target_size_mm);
  if (range.T_camera_ct_centre) return trial;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  trial.start = {kNone, kNone};
  trial.disturbance.setConstant(kNone);
  return trial;
}

std::vector<Trial> runTrials(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames,
                             const Eigen::Vector3d& centre_ct_mm, const TrialOptions& options,
                             const Progress& progress) {
  check(frames);
  check(options);
  RandomStarts starts(options.range, options.seed);
  // Another sequence, so that the CT's starts are the same with bodies and without.
  constexpr std::uint64_t kOfBodies = 0x9e3779b97f4a7c15ULL;
  RandomStarts own_starts(options.range, options.seed + kOfBodies);
  RandomStarts body_starts(options.body_range, options.seed + 2 * kOfBodies);
  runTrial(pipeline, frames.front(), Twist::Zero(), centre_ct_mm, options.target_size_mm);

  std::vector<Trial> trials;
  trials.reserve(static_cast<std::size_t>(options.trials));
  for (int i = 0; i < options.trials; ++i) {
    const EvaluationFrame& frame = frames[static_cast<std::size_t>(i) % frames.size()];
    const Twist disturbance = starts.next();
    const RigidTransform T_camera_ct_start =
        updatedPose(frame.T_camera_ct_true, disturbance, frame.T_camera_ct_true * centre_ct_mm);
    if (options.kind == TrialKind::kLost) {
      trials.push_back(lostTrial(pipeline, frames, static_cast<std::size_t>(i) % frames.size(),
                                 fullLength(disturbance, options.range), centre_ct_mm, options.target_size_mm));
      if (progress) progress(i + 1, options.trials);
      continue;
    }
    if (options.kind != TrialKind::kFromStart) {
      trials.push_back(localizeTrial(pipeline, frame, rangeAround(T_camera_ct_start, options), centre_ct_mm,
                                     options.target_size_mm));
      if (progress) progress(i + 1, options.trials);
      continue;
    }
    const auto poses = bodyStarts(*pipeline, frame, T_camera_ct_start, &own_starts, &body_starts);
    trials.push_back(runTrial(pipeline, frame, disturbance, centre_ct_mm, options.target_size_mm, poses));
    if (progress) progress(i + 1, options.trials);
  }
  return trials;
}

std::vector<Trial> followFrames(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames,
                                const Eigen::Vector3d& centre_ct_mm, double target_size_mm, const Progress& progress) {
  check(frames);
  runTrial(pipeline, frames.front(), Twist::Zero(), centre_ct_mm, target_size_mm);
  pipeline->reset();
  pipeline->setPose(frames.front().T_camera_ct_true, ownTruths(*pipeline, frames.front()));

  std::vector<Trial> trials;
  trials.reserve(frames.size());
  for (const EvaluationFrame& frame : frames) {
    // The tracker never loses its pose once it has one.
    const RigidTransform T_camera_ct_start = pipeline->prediction(frame.stamp_s).value_or(frame.T_camera_ct_true);
    trials.push_back(registerFrom(T_camera_ct_start, pipeline, frame, centre_ct_mm, target_size_mm));
    if (progress) progress(static_cast<int>(trials.size()), static_cast<int>(frames.size()));
  }
  return trials;
}

}  // namespace xray_registration
