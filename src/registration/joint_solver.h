#pragma once

#include "registration/joint_parameters.h"
#include "registration/score_test.h"

namespace xray_registration {

/// What all frames say at a hypothesis.
struct JointEvidence {
  std::vector<SetupEvidence> frames;
  int level = 0;
  double cost = 0.0;
  bool finite = false;
};

struct JointSolution {
  JointSetup setup;
  JointEvidence evidence;
  std::vector<double> robust_scales2;
  bool converged = false;
};

/// Damped Gauss-Newton in what the frames share and the pose of each, from a hypothesis. Without robust scales (one for
/// each frame) those of the start are taken; costs compare only where they are the same. With distortion among the
/// parameters no step is tested: start near.
JointSolution solveJointly(JointFrames* frames, const Stage& stage, const FreeParameters& free, const JointSetup& start,
                           const std::vector<double>& robust_scales2 = {});

/// By how many σ one solution explains the X-rays better than another: their costs are compared in blocks.
double betterBy(const JointEvidence& one, const JointEvidence& other);

/// What the frames say of the parameters together when each pose is free to follow. A CT's own errors stay where they
/// are from frame to frame, and reach over several windows: the scatter is of sums over blocks of neighbouring windows
/// and over all frames (clusters, K.-Y. Liang and S. L. Zeger, 1986).
Score jointScore(const JointFrames& frames, const JointSolution& solution, const FreeParameters& free);

/// Covariance of the parameters: S⁻¹ B S⁻¹ with the reduced curvature S and the scatter B of the windows' scores. What
/// no image can tell (a direction whose curvature is a millionth of what it would be with the poses known) comes out
/// with a huge variance.
Eigen::MatrixXd jointCovariance(const Score& score);

/// Mean correlation of the windows, weighted with their content.
double similarityOf(const JointEvidence& evidence);

}  // namespace xray_registration
