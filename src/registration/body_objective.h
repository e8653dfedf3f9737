#pragma once

#include <vector>

#include "registration/frame_objective.h"
#include "xray_registration/registration/body.h"

namespace xray_registration {

/// The objective of a body among what surrounds it. In each window the X-ray is explained by
/// X = a + b C + c B + noise with C the surroundings, B the body's own line integrals at the pose, and a, b, c ≥ 0 and
/// the noise's variance the window's own: gain, hardening and what the CT does not know differ from place to place. The
/// profile likelihood leaves
///   E(ξ) = −Σ n/2 log(RSS of X on (1, C) / RSS of X on (1, C, B)),
/// minus the logarithm of the likelihood ratio of body and no body. A plain correlation of X-ray and DRR does not do:
/// it is high wherever the body is when its surroundings are well known, and weighs windows by their contrast, not by
/// their noise (docs/design.md has figures).
///
/// Where the X-rays say nothing, as one view of depth, the body is where the rest has it: its motion against the rest
/// is normal with half its range as σ. What the X-rays do say is a hundred times as certain.
class BodyObjective : public FrameObjective {
 public:
  /// T_camera_neutral is where the rest has the body.
  BodyObjective(Engine* engine, DeviceViews* views, const RegistrarOptions& options, StepBudget* budget,
                const RigidTransform& T_camera_neutral, const BodyModel& model)
      : FrameObjective(engine, views, options, budget),
        T_camera_neutral_(T_camera_neutral),
        sigma_mm_(0.5 * model.max_translation_mm),
        sigma_rad_(0.5 * model.max_rotation_rad) {}

  /// Similarity: √(1 − exp(−2 Λ/n)), Λ the log-likelihood ratio and n the pixels of the body's shadow, which is the
  /// partial correlation that all windows together have. Inlier fraction: share of the shadow in windows that find the
  /// body by themselves.
  std::vector<StepSums> evaluate(const Stage& stage, double robust_scale2,
                                 const std::vector<RigidTransform>& T_camera_body) override;

  /// Turns move a small body's border less than an organ's.
  GaussNewtonOptions solverFor(const Stage& stage, const RigidTransform& start) const override;

  /// The similarity of each view that shows something of the body.
  std::vector<double> similarityOfViews(const Stage& stage, const RigidTransform& T_camera_body);

 private:
  StepSums evaluateView(const DeviceViews::View& view, const Stage& stage, const RigidTransform& T_camera_body);
  StepSums evaluateOne(const Stage& stage, const RigidTransform& T_camera_body);
  void addPrior(const Stage& stage, const RigidTransform& T_camera_body, StepSums* sums) const;

  RigidTransform T_camera_neutral_;
  double sigma_mm_;
  double sigma_rad_;
};

/// Windows of two tiles: small enough for gain and hardening to be one in each, large enough not to fit the noise.
inline Stage bodyStage(int level, int max_steps) { return {level, 2, max_steps}; }

}  // namespace xray_registration
