#pragma once

#include <string>
#include <vector>

#include "registration/score_test.h"
#include "registration/setup_hypotheses.h"
#include "registration/solution.h"
#include "xray_registration/registration/suspicion.h"

namespace xray_registration {

/// What a look at a solved frame says about what was told.
struct SetupOpinion {
  std::vector<SetupSuspicion> suspicions;
  std::string refusal;  ///< Why the pose is not to be trusted, in words; empty when nothing is certainly wrong.
};

/// Asks at solutions whether what was told (focal lengths, principal points, distortion, the views' poses, the CT's
/// size) is right. One evaluation with more derivatives gives a score test of each; evidence adds up over the frames
/// that were looked at, the older the less, and the frame at hand is asked by itself as well: a detector is knocked
/// from one frame to the next. Only what a test makes certain is tried (setup_trials.h). What moves in the images of
/// the frame when the pose is right (residual_field.h) and nothing that was tried explains is another patient's CT.
class SetupCheck {
 public:
  /// At a frame's solution, with the views weighed as for it. @throws DeviceError.
  SetupOpinion look(SetupObjective* objective, const Solution& solution, const std::vector<std::string>& view_names,
                    const AcceptOptions& accept);

  /// What is uncertain in the geometry and the CT's size adds to the pose's covariance, as of the last look: K diag(σ²)
  /// Kᵀ with K = M_pp⁻¹ M_pe; the parameters are considered, not solved for (S. F. Schmidt, 1966). Zero before.
  Matrix6d consideredCovariance(const SetupSigmas& sigmas) const;

  /// The next frame has nothing to do with the last one.
  void forget();

 private:
  void expect(const Setup& told, const std::vector<std::string>& view_names);
  void addUp(const SetupEvidence& seen);

  std::vector<SetupHypothesis> hypotheses_;
  std::vector<std::string> view_names_;
  std::vector<Score> scores_;  ///< One for each hypothesis.
  std::vector<Score> own_;     ///< The same of the last look alone.
  Eigen::MatrixXd follows_;    ///< M_pp⁻¹ M over the layout; empty before the first look.
};

}  // namespace xray_registration
