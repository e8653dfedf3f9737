#include "xray_registration/evaluation/trials.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "xray_registration/common/stopwatch.h"

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

/// A pose that is no pose counts as infinitely wrong: statistics must not lose it in comparisons with NaN.
PoseError finalError(const RigidTransform& T_camera_ct_found, const RigidTransform& T_camera_ct_true,
                     const std::vector<Eigen::Vector3d>& targets_ct_mm) {
  if (!T_camera_ct_found.matrix().allFinite()) {
    return {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  }
  return poseError(T_camera_ct_found, T_camera_ct_true, targets_ct_mm);
}

Trial trialOf(const EvaluationFrame& frame) {
  Trial trial;
  trial.frame = frame.index;
  trial.stamp_s = frame.stamp_s;
  trial.prepare_ms = frame.prepare_ms;
  return trial;
}

}  // namespace

double RandomStarts::uniform(double low, double high) {
  // The upper 53 bits fill a double's mantissa: exact on every platform.
  const double zero_to_one = static_cast<double>(bits_() >> 11U) * 0x1.0p-53;
  return low + (high - low) * zero_to_one;
}

Eigen::Vector3d RandomStarts::unitVector() {
  // Rejection from the cube: uniform on the sphere without sines that differ in their last bit between libraries.
  while (true) {
    const double x = uniform(-1.0, 1.0);
    const double y = uniform(-1.0, 1.0);
    const double z = uniform(-1.0, 1.0);
    const double squared = x * x + y * y + z * z;
    if (squared <= 1.0 && squared > 1e-4) return Eigen::Vector3d(x, y, z) / std::sqrt(squared);
  }
}

Twist RandomStarts::next() {
  Twist disturbance;
  const Eigen::Vector3d axis = unitVector();
  disturbance.tail<3>() = axis * uniform(-range_.rotation_rad, range_.rotation_rad);
  for (int i = 0; i < 3; ++i) disturbance(i) = uniform(-range_.translation_mm, range_.translation_mm);
  return disturbance;
}

std::vector<Trial> runTrials(Registrar* registrar, const std::vector<EvaluationFrame>& frames,
                             const Eigen::Vector3d& centre_ct_mm, const TrialOptions& options,
                             const Progress& progress) {
  check(frames);
  check(options);
  const std::vector<Eigen::Vector3d> targets_ct_mm = targetGrid(centre_ct_mm, options.target_size_mm);
  RandomStarts starts(options.range, options.seed);
  registrar->registerFrame(frames.front().views, frames.front().T_camera_ct_true, false);

  std::vector<Trial> trials;
  trials.reserve(static_cast<std::size_t>(options.trials));
  for (int i = 0; i < options.trials; ++i) {
    const EvaluationFrame& frame = frames[static_cast<std::size_t>(i) % frames.size()];
    Trial trial = trialOf(frame);
    trial.disturbance = starts.next();
    const RigidTransform T_camera_ct_start =
        updatedPose(frame.T_camera_ct_true, trial.disturbance, frame.T_camera_ct_true * centre_ct_mm);
    const Stopwatch watch;
    trial.result = registrar->registerFrame(frame.views, T_camera_ct_start, false);
    trial.solve_ms = watch.milliseconds();
    trial.start = poseError(T_camera_ct_start, frame.T_camera_ct_true, targets_ct_mm);
    trial.final = finalError(trial.result.T_camera_ct, frame.T_camera_ct_true, targets_ct_mm);
    trials.push_back(std::move(trial));
    if (progress) progress(i + 1, options.trials);
  }
  return trials;
}

std::vector<Trial> followFrames(Registrar* registrar, Tracker* tracker, const std::vector<EvaluationFrame>& frames,
                                const Eigen::Vector3d& centre_ct_mm, double target_size_mm, const Progress& progress) {
  check(frames);
  const std::vector<Eigen::Vector3d> targets_ct_mm = targetGrid(centre_ct_mm, target_size_mm);
  registrar->registerFrame(frames.front().views, frames.front().T_camera_ct_true, false);
  tracker->setPose(frames.front().T_camera_ct_true);

  std::vector<Trial> trials;
  trials.reserve(frames.size());
  for (const EvaluationFrame& frame : frames) {
    Trial trial = trialOf(frame);
    // The tracker never loses its pose once it has one.
    const RigidTransform T_camera_ct_start = tracker->prediction(frame.stamp_s).value_or(frame.T_camera_ct_true);
    const Stopwatch watch;
    trial.result = tracker->process(registrar, frame.views, frame.stamp_s);
    trial.solve_ms = watch.milliseconds();
    trial.disturbance = twistBetween(frame.T_camera_ct_true, T_camera_ct_start, frame.T_camera_ct_true * centre_ct_mm);
    trial.start = poseError(T_camera_ct_start, frame.T_camera_ct_true, targets_ct_mm);
    trial.final = finalError(trial.result.T_camera_ct, frame.T_camera_ct_true, targets_ct_mm);
    trials.push_back(std::move(trial));
    if (progress) progress(static_cast<int>(trials.size()), static_cast<int>(frames.size()));
  }
  return trials;
}

}  // namespace xray_registration
