#pragma once

#include <Eigen/Core>

#include "registration/setup_objective.h"

namespace xray_registration {

/// What evaluations say about some parameters when the pose is free to follow them: with g, M the gradient and matrix,
/// the score r = g_e − M_ep M_pp⁻¹ g_p and its curvature S = M_ee − M_ep M_pp⁻¹ M_pe (C. R. Rao, 1948). Frames add up.
struct Score {
  Eigen::VectorXd score;
  Eigen::MatrixXd curvature;
  Eigen::MatrixXd scatter;  ///< Σ of the windows' own scores' outer products.
  Eigen::VectorXd own;      ///< Diagonal of M_ee: the curvature if the pose were known.
  Eigen::MatrixXd follows;  ///< M_pp⁻¹ M_pe, of the last frame: the pose moves by −follows · e.

  bool empty() const { return score.size() == 0; }
  void add(const Score& other);
  /// Counts for so much of what it did.
  void fade(double kept);
};

/// `basis`: layout × parameters. Empty when the pose itself is not determined.
Score scoreOf(const SetupEvidence& evidence, const Eigen::MatrixXd& basis);

/// What a score estimates.
struct ScoreTest {
  bool determined = false;            ///< The views fix the parameters; without it the rest means nothing.
  Eigen::VectorXd estimate;           ///< One Gauss-Newton step, e = −S⁻¹ r.
  Eigen::MatrixXd covariance;         ///< From the windows' own scores (P. J. Huber, 1967).
  Twist pose_effect = Twist::Zero();  ///< What they would move the pose by: the right pose less the present one.
  double effect_mm = 0.0;             ///< The same as motion of points around the CT's centre.
  double gain = 0.0;                  ///< rᵀS⁻¹r: twice the cost that the estimate would take away.
  double deviations = 0.0;            ///< How many σ the estimate is from zero: √(eᵀ C⁻¹ e / parameters).
};
ScoreTest conclude(const Score& score);

/// Motion of points on the target sphere by a twist, root mean square, mm.
double motionMm(const Twist& twist);

}  // namespace xray_registration
