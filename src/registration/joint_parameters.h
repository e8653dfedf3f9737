#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <string>
#include <vector>

#include "registration/joint_frames.h"

namespace xray_registration {

/// The groups' names.
constexpr char kFocalLength[] = "focal_length";
constexpr char kPrincipalPoint[] = "principal_point";
constexpr char kDistortion[] = "distortion";
constexpr char kViewPose[] = "view_pose";

/// Parameters that are calibrated or held together: of one view, or the same ones of several, which one device took.
struct CalibratedGroup {
  std::string what;
  std::vector<std::size_t> views;
  int parameter = 0;       ///< The first one's place in a view's block of SetupLayout.
  Eigen::VectorXd limits;  ///< σ of each from which it is not determined.

  bool isOf(std::size_t view) const { return std::find(views.begin(), views.end(), view) != views.end(); }
};
using CalibratedGroups = std::vector<CalibratedGroup>;

/// All that a calibration may find out of the views one by one, in their order.
CalibratedGroups calibratedGroups(const JointFrames& frames, const JointSetup& setup, const CalibrationLimits& limits);

/// What is solved for: some groups, their parameters one after the other.
class FreeParameters {
 public:
  FreeParameters(std::size_t views, CalibratedGroups groups);

  const CalibratedGroups& groups() const { return groups_; }
  /// Place of a group's first parameter.
  int placeOf(std::size_t group) const { return places_[group]; }
  int size() const { return size_; }
  /// Whether distortion is among them.
  bool bends() const;
  /// One for each parameter.
  Eigen::VectorXd limits() const;

  /// Layout × parameters for one frame. A view's pose turns about one point for all frames, the mean of where they have
  /// the CT's centre, while a frame's own evidence is about the centre in that frame.
  Eigen::MatrixXd basis(const JointSetup& setup, std::size_t frame, const Eigen::Vector3d& centre_ct_mm) const;

  /// The hypothesis moved by a step of the parameters, and of the frames' poses.
  JointSetup moved(const JointSetup& setup, const Eigen::VectorXd& step, const std::vector<Twist>& poses,
                   const Eigen::Vector3d& centre_ct_mm) const;

 private:
  std::size_t views_;
  CalibratedGroups groups_;
  std::vector<int> places_;
  int size_ = 0;
};

/// Mean over the frames of the CT's centre in the first view's camera.
Eigen::Vector3d meanCentre(const JointSetup& setup, const Eigen::Vector3d& centre_ct_mm);

}  // namespace xray_registration
