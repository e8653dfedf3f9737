#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "xray_registration/evaluation/random_starts.h"
#include "xray_registration/evaluation/trial.h"
#include "xray_registration/pipeline/registration_pipeline.h"

namespace xray_registration {

/// One frame with its true pose.
struct EvaluationFrame {
  int index = 0;  ///< In the session.
  double stamp_s = 0.0;
  std::vector<RawView> views;
  RigidTransform T_camera_ct_true = RigidTransform::Identity();  ///< First view's camera.
  std::map<std::string, RigidTransform> T_camera_bodies_true;    ///< By name.
};

/// How a trial finds its pose.
enum class TrialKind {
  kFromStart,    ///< As a frame is registered from the start that it was given.
  kLocalize,     ///< By a wide search, its range that of the starts, its centre the start.
  kLost,         ///< It was lost elsewhere: off by the range's full rotation and translation (lost_trial.h).
  kFromNothing,  ///< By a wide search without any start. The trial's start errors are NaN.
};

struct TrialOptions {
  TrialKind kind = TrialKind::kFromStart;
  int trials = 100;
  StartRange range;
  StartRange body_range;  ///< Of each body against the CT's start.
  std::uint64_t seed = 1;
  double target_size_mm = 100.0;
};

/// Side of the cube of targets about a body's centre, mm.
constexpr double kBodyTargetSizeMm = 40.0;

/// Called after each trial with how many are done and how many there will be.
using Progress = std::function<void(int done, int all)>;

/// One cold registration through the pipeline, as if the frame were the first of a session. The pipeline keeps the pose
/// that it found.
/// @param disturbance  Start against truth, about `centre_ct_mm` in camera axes.
/// @throws DeviceError when the pipeline's state is FAULT afterwards.
/// @param T_camera_bodies  Where bodies start, by name; those that are not in it start with the CT.
Trial runTrial(RegistrationPipeline* pipeline, const EvaluationFrame& frame, const Twist& disturbance,
               const Eigen::Vector3d& centre_ct_mm, double target_size_mm,
               const RegistrationPipeline::BodyPoses& T_camera_bodies = {});

/// The same by a wide search in the frame.
Trial localizeTrial(RegistrationPipeline* pipeline, const EvaluationFrame& frame, const WideSearchRange& range,
                    const Eigen::Vector3d& centre_ct_mm, double target_size_mm);

/// Registers from random starts; trial i takes frame i modulo their number. `centre_ct_mm` is where starts are turned
/// about and where the targets' cube stands. One registration from the truth warms the device up beforehand, untimed.
/// @throws std::invalid_argument without frames or for options out of range; DeviceError as runTrial does.
std::vector<Trial> runTrials(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames,
                             const Eigen::Vector3d& centre_ct_mm, const TrialOptions& options,
                             const Progress& progress = {});

/// Follows all frames in order from the first frame's true pose. A trial's start is the prediction.
/// @throws as runTrials.
std::vector<Trial> followFrames(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames,
                                const Eigen::Vector3d& centre_ct_mm, double target_size_mm,
                                const Progress& progress = {});

}  // namespace xray_registration
