#include "registration/setup.h"

#include <cmath>

namespace xray_registration {
namespace {

Eigen::Matrix3d strainOf(const Eigen::VectorXd& correction) {
  const auto s = correction.segment<6>(SetupLayout::kStrain);
  Eigen::Matrix3d strain;
  strain << s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2];
  return strain;
}

}  // namespace

Setup toldSetup(const DeviceViews& views, const RigidTransform& T_camera_ct) {
  Setup setup;
  setup.T_camera_ct = T_camera_ct;
  for (const DeviceViews::View& view : views.views()) setup.views.push_back({1.0, {0.0, 0.0}, view.T_view_first});
  return setup;
}

Setup corrected(const Setup& setup, const Eigen::VectorXd& correction, const Eigen::Vector3d& centre_ct_mm) {
  const SetupLayout layout(setup.views.size());
  Setup moved = setup;
  const Eigen::Vector3d centre = setup.T_camera_ct * centre_ct_mm;
  moved.T_camera_ct = updatedPose(setup.T_camera_ct, correction.segment<6>(SetupLayout::kPose), centre);
  moved.ct_stretch = (Eigen::Matrix3d::Identity() + strainOf(correction)) * setup.ct_stretch;
  for (std::size_t v = 0; v < setup.views.size(); ++v) {
    ViewSetup& view = moved.views[v];
    view.focal_scale *= std::exp(correction[layout.of(v, SetupLayout::kFocal)]);
    view.centre_shift_px += correction.segment<2>(layout.of(v, SetupLayout::kCentre));
    if (v == 0) continue;
    view.T_view_first = updatedPose(view.T_view_first, correction.segment<6>(layout.of(v, SetupLayout::kViewPose)),
                                    view.T_view_first * centre);
  }
  return moved;
}

Eigen::VectorXd setupDifference(const Setup& from, const Setup& to, const Eigen::Vector3d& centre_ct_mm) {
  const SetupLayout layout(from.views.size());
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(layout.size());
  const Eigen::Vector3d centre = from.T_camera_ct * centre_ct_mm;
  difference.segment<6>(SetupLayout::kPose) = twistBetween(from.T_camera_ct, to.T_camera_ct, centre);
  const Eigen::Matrix3d strain = to.ct_stretch - from.ct_stretch;
  difference.segment<6>(SetupLayout::kStrain) << strain(0, 0), strain(1, 1), strain(2, 2), strain(0, 1), strain(0, 2),
      strain(1, 2);
  for (std::size_t v = 0; v < from.views.size(); ++v) {
    const ViewSetup& a = from.views[v];
    const ViewSetup& b = to.views[v];
    difference[layout.of(v, SetupLayout::kFocal)] = std::log(b.focal_scale / a.focal_scale);
    difference.segment<2>(layout.of(v, SetupLayout::kCentre)) = b.centre_shift_px - a.centre_shift_px;
    if (v == 0) continue;
    difference.segment<6>(layout.of(v, SetupLayout::kViewPose)) =
        twistBetween(a.T_view_first, b.T_view_first, a.T_view_first * centre);
  }
  return difference;
}

}  // namespace xray_registration
