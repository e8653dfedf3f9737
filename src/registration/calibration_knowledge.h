#pragma once

#include <vector>

#include "registration/joint_solver.h"

namespace xray_registration {

/// What is known of one group: when it was not freed, from what freeing it as well would do.
struct GroupKnowledge {
  Eigen::MatrixXd covariance;
  Eigen::VectorXd estimate;  ///< One step from the solution.
  bool determined = false;
};

/// What the frames tell of a calibration's parameters, and how well, at a solution.
///
/// They are looked at on the finest level whose pixels are not much smaller than half a voxel. What X-rays show more
/// finely than that are not the CT's contours but its errors, which are alike all along an edge and in every frame: on
/// finer levels σ is what noise would leave, a fifth of the errors with a CT of 2 mm in X-rays of 0.6 mm.
class CalibrationKnowledge {
 public:
  /// `frames` are made for the solution and outlive this. @throws DeviceError.
  CalibrationKnowledge(JointFrames* frames, const JointSolution& solution);

  /// Of `groups` those that the frames determine together: the least determined is left out, one after the other. A
  /// view's pose stays where the X-rays contradict what was told of it: held, it would only go elsewhere, since it
  /// takes up what others imitate.
  CalibratedGroups determinedOf(CalibratedGroups groups, const JointSetup& told) const;

  GroupKnowledge of(CalibratedGroups free, const CalibratedGroup& asked) const;

  /// What was found with `groups` freed. A focal length or principal point of `single` that the frames do not determine
  /// beside them may be as wrong as they leave it, so it counts as free: what depends on it has a σ that covers it. A
  /// pose of six parameters is not needed beside the one or two that explain the X-rays, nor a distortion that is not
  /// seen.
  std::vector<CalibratedView> viewsOf(const CalibratedGroups& groups, const CalibratedGroups& single) const;

 private:
  bool isContradicted(const CalibratedGroup& group, const Eigen::MatrixXd& covariance, const JointSetup& told) const;
  /// The group whose σ exceeds its limits by the largest factor; the number of groups when none does.
  std::size_t leastDetermined(const FreeParameters& free, const JointSetup& told) const;
  /// Cameras' parameters that are not determined beside `groups`.
  CalibratedGroups openBeside(const CalibratedGroups& groups, const CalibratedGroups& single) const;

  const JointFrames& frames_;
  JointSolution seen_;
};

}  // namespace xray_registration
