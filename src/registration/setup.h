#pragma once

#include <vector>

#include "registration/device_views.h"

namespace xray_registration {

/// What one view was taken with, where it may differ from what was told.
struct ViewSetup {
  double focal_scale = 1.0;                                   ///< True over told.
  Eigen::Vector2d centre_shift_px = Eigen::Vector2d::Zero();  ///< True less told, pixels of the image as it came.
  RigidTransform T_view_first = RigidTransform::Identity();
};

/// A hypothesis about everything that makes the pictures: the pose, what the views were taken with, the CT's size.
struct Setup {
  RigidTransform T_camera_ct = RigidTransform::Identity();
  std::vector<ViewSetup> views;
  Eigen::Matrix3d ct_stretch = Eigen::Matrix3d::Identity();  ///< Of the CT about its centre, CT axes.
};

/// As it was told, with a pose.
Setup toldSetup(const DeviceViews& views, const RigidTransform& T_camera_ct);

/// Where the parameters of a set-up stand in a vector of corrections. Units: the pose's twist mm and rad about the CT's
/// centre in the first camera's axes; strains; per view the logarithm of the focal length, the principal point in
/// pixels, the coefficients of radial and S-shaped distortion, the view's own twist (none for the first one, whose
/// camera is the frame of the pose).
class SetupLayout {
 public:
  explicit SetupLayout(std::size_t views) : views_(static_cast<int>(views)) {}

  static constexpr int kPose = 0;
  static constexpr int kStrain = 6;
  static constexpr int kFocal = 0, kCentre = 1, kRadial = 3, kSwirl = 4, kViewPose = 5;  ///< Inside a view's block.
  static constexpr int kViewSize = 11;

  int of(std::size_t view, int parameter) const { return 12 + kViewSize * static_cast<int>(view) + parameter; }
  int size() const { return 12 + kViewSize * views_; }
  std::size_t views() const { return static_cast<std::size_t>(views_); }

 private:
  int views_;
};

/// The correction that carries one set-up to another, to first order in the strain.
Eigen::VectorXd setupDifference(const Setup& from, const Setup& to, const Eigen::Vector3d& centre_ct_mm);

/// The set-up moved by a correction; distortions have no place in it and are left out.
Setup corrected(const Setup& setup, const Eigen::VectorXd& correction, const Eigen::Vector3d& centre_ct_mm);

}  // namespace xray_registration
