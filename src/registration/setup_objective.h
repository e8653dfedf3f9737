#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "registration/frame_objective.h"
#include "registration/setup.h"

namespace xray_registration {

/// What one window of one view says about a set-up.
struct SetupWindow {
  std::size_t view = 0;
  int x = 0;  ///< Tile.
  int y = 0;
  double content = 0.0;
  double correlation = 0.0;
  double cost = 0.0;
  /// Gauss-Newton, by the principal point of the window's rays in pixels, and mixed with the pose.
  Eigen::Matrix2d by_shift = Eigen::Matrix2d::Zero();
  Eigen::Matrix<double, 6, 2> pose_by_shift = Eigen::Matrix<double, 6, 2>::Zero();
};

/// The frame's objective at a set-up, with derivatives by everything that may be wrong.
struct SetupEvidence {
  SetupEvidence() = default;
  explicit SetupEvidence(const SetupLayout& layout)
      : gradient(Eigen::VectorXd::Zero(layout.size())), matrix(Eigen::MatrixXd::Zero(layout.size(), layout.size())) {}
  bool finite() const { return std::isfinite(cost) && gradient.allFinite() && matrix.allFinite(); }

  Eigen::VectorXd gradient;
  Eigen::MatrixXd matrix;  ///< Gauss-Newton.
  double cost = 0.0;
  std::vector<double> mm_per_pixel;  ///< By view: at the CT, of the image as it came.
  std::vector<SetupWindow> windows;
  Eigen::MatrixXd gradients;  ///< Layout × windows: their own, which add up to the gradient.
};

/// The objective over set-ups instead of poses: slower than FrameObjective, asked now and then. Distortion is asked for
/// as a derivative only. @throws DeviceError from every call.
class SetupObjective {
 public:
  /// All must outlive it.
  SetupObjective(Engine* engine, DeviceViews* views, StepBudget* budget)
      : engine_(engine), views_(views), budget_(budget) {}

  /// Nothing when the frame's budget is used up.
  std::optional<SetupEvidence> evaluate(const Setup& setup, const Stage& stage, double robust_scale2);

  const DeviceViews& views() const { return *views_; }
  const Eigen::Vector3d& centreCt() const { return views_->centreCt(); }

 private:
  void addView(std::size_t index, const Setup& setup, const Stage& stage, double robust_scale2,
               SetupEvidence* evidence);

  Engine* engine_;
  DeviceViews* views_;
  StepBudget* budget_;
};

}  // namespace xray_registration
