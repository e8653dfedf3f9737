#include "xray_registration/evaluation/trials.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "xray_registration/drr/device.h"

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

/// The frame through the pipeline from where the pipeline stands.
Trial registerFrom(const RigidTransform& T_camera_ct_start, RegistrationPipeline* pipeline,
                   const EvaluationFrame& frame, const Eigen::Vector3d& centre_ct_mm, double target_size_mm) {
  const FrameOutcome outcome = pipeline->process(frame.stamp_s, frame.views);
  if (outcome.state == TrackingState::kFault) throw DeviceError("the device failed: " + pipeline->fault(), 0);
  Trial trial;
  trial.frame = frame.index;
  trial.stamp_s = frame.stamp_s;
  trial.disturbance = twistBetween(frame.T_camera_ct_true, T_camera_ct_start, frame.T_camera_ct_true * centre_ct_mm);
  trial.result = outcome.result;
  if (!outcome.registered) trial.result.T_camera_ct = T_camera_ct_start;
  trial.prepare_ms = outcome.prepare_ms;
  trial.solve_ms = outcome.total_ms - outcome.prepare_ms;
  const std::vector<Eigen::Vector3d> targets_ct_mm = targetGrid(centre_ct_mm, target_size_mm);
  trial.start = poseError(T_camera_ct_start, frame.T_camera_ct_true, targets_ct_mm);
  trial.final = poseError(trial.result.T_camera_ct, frame.T_camera_ct_true, targets_ct_mm);
  return trial;
}

}  // namespace

Trial runTrial(RegistrationPipeline* pipeline, const EvaluationFrame& frame, const Twist& disturbance,
               const Eigen::Vector3d& centre_ct_mm, double target_size_mm) {
  const RigidTransform T_camera_ct_start =
      updatedPose(frame.T_camera_ct_true, disturbance, frame.T_camera_ct_true * centre_ct_mm);
  pipeline->reset();
  pipeline->setPose(T_camera_ct_start);
  Trial trial = registerFrom(T_camera_ct_start, pipeline, frame, centre_ct_mm, target_size_mm);
  trial.disturbance = disturbance;
  return trial;
}

std::vector<Trial> runTrials(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames,
                             const Eigen::Vector3d& centre_ct_mm, const TrialOptions& options,
                             const Progress& progress) {
  check(frames);
  check(options);
  RandomStarts starts(options.range, options.seed);
  runTrial(pipeline, frames.front(), Twist::Zero(), centre_ct_mm, options.target_size_mm);

  std::vector<Trial> trials;
  trials.reserve(static_cast<std::size_t>(options.trials));
  for (int i = 0; i < options.trials; ++i) {
    const EvaluationFrame& frame = frames[static_cast<std::size_t>(i) % frames.size()];
    trials.push_back(runTrial(pipeline, frame, starts.next(), centre_ct_mm, options.target_size_mm));
    if (progress) progress(i + 1, options.trials);
  }
  return trials;
}

std::vector<Trial> followFrames(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames,
                                const Eigen::Vector3d& centre_ct_mm, double target_size_mm, const Progress& progress) {
  check(frames);
  runTrial(pipeline, frames.front(), Twist::Zero(), centre_ct_mm, target_size_mm);
  pipeline->reset();
  pipeline->setPose(frames.front().T_camera_ct_true);

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
