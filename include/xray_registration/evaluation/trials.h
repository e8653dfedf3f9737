#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "xray_registration/evaluation/pose_error.h"
#include "xray_registration/registration/registrar.h"
#include "xray_registration/registration/tracker.h"

namespace xray_registration {

/// How far random starts lie from the truth.
struct StartRange {
  double rotation_rad = 0.0;    ///< The angle is uniform in ±rotation, its axis uniform on the sphere.
  double translation_mm = 0.0;  ///< Each component is uniform in ±translation, camera axes.
};

/// Random disturbances of a pose, about the CT's centre in camera axes. Made from the bits of std::mt19937_64 with
/// arithmetic of its own, because the standard's distributions differ between libraries: the same seed gives the same
/// starts everywhere.
class RandomStarts {
 public:
  RandomStarts(const StartRange& range, std::uint64_t seed) : range_(range), bits_(seed) {}

  /// The next disturbance, for updatedPose.
  Twist next();

 private:
  double uniform(double low, double high);
  Eigen::Vector3d unitVector();

  StartRange range_;
  std::mt19937_64 bits_;
};

/// One frame with its true pose.
struct EvaluationFrame {
  int index = 0;  ///< In the session.
  double stamp_s = 0.0;
  std::vector<ViewInput> views;
  RigidTransform T_camera_ct_true = RigidTransform::Identity();  ///< First view's camera.
  double prepare_ms = 0.0;  ///< From the image in memory to `views`: linearised, undistorted, masked.
};

/// One registration whose truth is known.
struct Trial {
  int frame = 0;  ///< EvaluationFrame::index.
  double stamp_s = 0.0;
  Twist disturbance = Twist::Zero();  ///< Start against truth, about the centre of the targets.
  PoseError start;
  PoseError final;
  RegistrationResult result;
  double prepare_ms = 0.0;
  double solve_ms = 0.0;  ///< Wall clock of the registration, uploads of images and verdict included.
};

struct TrialOptions {
  int trials = 100;
  StartRange range;
  std::uint64_t seed = 1;
  double target_size_mm = 100.0;
};

/// Called after each trial with how many are done and how many there will be.
using Progress = std::function<void(int done, int all)>;

/// Registers from random starts; trial i takes frame i modulo their number. `centre_ct_mm` is where starts are turned
/// about and where the targets' cube stands. One registration from the truth warms the device up beforehand, untimed.
/// @throws std::invalid_argument without frames or for options out of range; DeviceError from the registrar.
std::vector<Trial> runTrials(Registrar* registrar, const std::vector<EvaluationFrame>& frames,
                             const Eigen::Vector3d& centre_ct_mm, const TrialOptions& options,
                             const Progress& progress = {});

/// Follows all frames in order through `tracker`, from the first frame's true pose. A trial's start is the prediction.
std::vector<Trial> followFrames(Registrar* registrar, Tracker* tracker, const std::vector<EvaluationFrame>& frames,
                                const Eigen::Vector3d& centre_ct_mm, double target_size_mm,
                                const Progress& progress = {});

}  // namespace xray_registration
