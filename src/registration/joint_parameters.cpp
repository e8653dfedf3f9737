#include "registration/joint_parameters.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "xray_registration/geometry/cross_matrix.h"

namespace xray_registration {
namespace {

constexpr double kLimitsWidth = 256.0;  ///< Of the image that the limits in pixels are for.

/// The coefficient that moves a pixel at half the image's width by so much.
double radialMoving(double pixels, const XrayCamera& camera) {
  const double half = 0.5 * camera.width;
  const double radius = half / camera.fx;
  return pixels / (half * radius * radius);
}

}  // namespace

CalibratedGroups calibratedGroups(const JointFrames& frames, const JointSetup& setup, const CalibrationLimits& limits) {
  const Eigen::Vector3d centre = meanCentre(setup, frames.centreCt());
  CalibratedGroups groups;
  for (std::size_t v = 0; v < setup.views.size(); ++v) {
    const XrayCamera& camera = frames.camera(v);
    const double pixels = camera.width / kLimitsWidth;
    const auto add = [&](const char* what, int parameter, const Eigen::VectorXd& most) {
      groups.push_back({what, {v}, parameter, most});
    };
    add(kFocalLength, SetupLayout::kFocal, Eigen::VectorXd::Constant(1, limits.focal_scale));
    add(kPrincipalPoint, SetupLayout::kCentre, Eigen::VectorXd::Constant(2, pixels * limits.centre_px));
    add(kDistortion, SetupLayout::kRadial,
        Eigen::VectorXd::Constant(1, radialMoving(pixels * limits.distortion_px, camera)));
    if (v == 0) continue;
    Eigen::VectorXd pose(6);
    pose << Eigen::Vector3d::Constant(limits.translation_mm), Eigen::Vector3d::Constant(limits.rotation_rad);
    // Along the ray what counts is the size in the image, as of the focal length.
    pose[2] = limits.focal_scale * (setup.views[v].T_view_first * centre).z();
    add(kViewPose, SetupLayout::kViewPose, pose);
  }
  return groups;
}

Eigen::Vector3d meanCentre(const JointSetup& setup, const Eigen::Vector3d& centre_ct_mm) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const RigidTransform& pose : setup.T_camera_ct) sum += pose * centre_ct_mm;
  return sum / static_cast<double>(setup.T_camera_ct.size());
}

FreeParameters::FreeParameters(std::size_t views, CalibratedGroups groups) : views_(views), groups_(std::move(groups)) {
  for (const CalibratedGroup& group : groups_) {
    places_.push_back(size_);
    size_ += static_cast<int>(group.limits.size());
  }
}

bool FreeParameters::bends() const {
  return std::any_of(groups_.begin(), groups_.end(),
                     [](const CalibratedGroup& group) { return group.what == kDistortion; });
}

Eigen::VectorXd FreeParameters::limits() const {
  Eigen::VectorXd all(size_);
  for (std::size_t i = 0; i < groups_.size(); ++i)
    all.segment(places_[i], groups_[i].limits.size()) = groups_[i].limits;
  return all;
}

Eigen::MatrixXd FreeParameters::basis(const JointSetup& setup, std::size_t frame,
                                      const Eigen::Vector3d& centre_ct_mm) const {
  const SetupLayout layout(views_);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(layout.size(), size_);
  const Eigen::Vector3d from_mean = setup.T_camera_ct[frame] * centre_ct_mm - meanCentre(setup, centre_ct_mm);
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    const auto count = groups_[i].limits.size();
    for (const std::size_t view : groups_[i].views) {
      const int first = layout.of(view, groups_[i].parameter);
      basis.block(first, places_[i], count, count).setIdentity();
      if (groups_[i].what != kViewPose) continue;
      // What turns about the mean centre moves this frame's centre too: v = v₀ + ω × (c − c₀).
      basis.block<3, 3>(first, places_[i] + 3) = -crossMatrix(setup.views[view].T_view_first.linear() * from_mean);
    }
  }
  return basis;
}

JointSetup FreeParameters::moved(const JointSetup& setup, const Eigen::VectorXd& step, const std::vector<Twist>& poses,
                                 const Eigen::Vector3d& centre_ct_mm) const {
  const SetupLayout layout(views_);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(layout.size());
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    const auto count = groups_[i].limits.size();
    for (const std::size_t view : groups_[i].views) {
      all.segment(layout.of(view, groups_[i].parameter), count) = step.segment(places_[i], count);
    }
  }
  const Eigen::Vector3d centre = meanCentre(setup, centre_ct_mm);
  JointSetup moved = setup;
  for (std::size_t v = 0; v < views_; ++v) {
    ViewGeometry& view = moved.views[v];
    view.focal_scale *= std::exp(all[layout.of(v, SetupLayout::kFocal)]);
    view.centre_shift_px += all.segment<2>(layout.of(v, SetupLayout::kCentre));
    // The motion straightens a pixel's ray, k1 bends a ray's pixel: opposite to first order.
    view.radial -= all[layout.of(v, SetupLayout::kRadial)];
    if (v == 0) continue;
    view.T_view_first = updatedPose(view.T_view_first, all.segment<6>(layout.of(v, SetupLayout::kViewPose)),
                                    view.T_view_first * centre);
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    RigidTransform& pose = moved.T_camera_ct[i];
    pose = updatedPose(pose, poses[i], pose * centre_ct_mm);
  }
  return moved;
}

}  // namespace xray_registration
