#pragma once

#include <vector>

#include "registration/device_views.h"
#include "registration/solution.h"
#include "registration/stage.h"
#include "registration/step_budget.h"

namespace xray_registration {

/// Radius about the CT's centre over which motion is measured: an organ's size.
constexpr double kTargetRadiusMm = 60.0;

/// The objective of one frame: the views' normal equations, carried into the first view's camera and added. Every
/// evaluation is drawn from the frame's budget. @throws DeviceError from every call.
class FrameObjective {
 public:
  /// All must outlive the objective.
  FrameObjective(Engine* engine, DeviceViews* views, const RegistrarOptions& options, StepBudget* budget)
      : engine_(engine), views_(views), options_(options), budget_(budget) {}
  virtual ~FrameObjective() = default;

  /// Objective and normal equations for many poses in one launch a view; empty when the budget is used up.
  virtual std::vector<StepSums> evaluate(const Stage& stage, double robust_scale2,
                                         const std::vector<RigidTransform>& T_camera_ct);

  /// Runs one stage from where the solution stands, with its robust scale. False when nothing is left of the budget:
  /// the solution then stays where it is, unconverged.
  bool solve(const Stage& stage, Solution* solution);

  /// Correlations of the windows that count, of all views.
  std::vector<float> correlations(const Stage& stage, const RigidTransform& T_camera_ct);

  /// The scale² on 1 − correlation at which a window keeps a quarter of its weight: three times the median error.
  double robustScale(const Stage& stage, const RigidTransform& T_camera_ct);

  /// What bounds the solver on a stage.
  virtual GaussNewtonOptions solverFor(const Stage& stage, const RigidTransform& start) const;

  DeviceViews& views() const { return *views_; }
  const RegistrarOptions& options() const { return options_; }
  bool exceeded() const { return budget_->exceeded(); }

 protected:
  Engine* engine() const { return engine_; }
  bool drawStep() { return budget_->draw(); }

 private:
  std::vector<StepSums> evaluateView(const DeviceViews::View& view, const Stage& stage, double robust_scale2,
                                     const std::vector<RigidTransform>& T_camera_ct);

  Engine* engine_;
  DeviceViews* views_;
  const RegistrarOptions& options_;
  StepBudget* budget_;
};

}  // namespace xray_registration
