#include "registration/setup_objective.h"

#include "xray_registration/drr/window_evidence.h"

namespace xray_registration {
namespace {

/// Of a view: the twist's six, then in the layout's order of a view's block what its camera may be wrong by, then the
/// strains.
constexpr int kCameraMotions = 5;
constexpr int kMotions = 6 + kCameraMotions + 6;

std::vector<RayMotion> motionsOf(const XrayCamera& told, const RigidTransform& T_view_ct,
                                 const Eigen::Vector3d& centre_view_mm) {
  std::vector<RayMotion> motions;
  motions.reserve(kMotions);
  for (int i = 0; i < 6; ++i) motions.push_back(motionByTwist(i, centre_view_mm));
  motions.push_back(motionByFocalLength());
  motions.push_back(motionByPrincipalPoint(0, told));
  motions.push_back(motionByPrincipalPoint(1, told));
  motions.push_back(motionByRadialDistortion());
  motions.push_back(motionBySwirl());
  constexpr int kPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
  for (const auto& pair : kPairs) {
    Eigen::Matrix3d strain = Eigen::Matrix3d::Zero();
    strain(pair[0], pair[1]) = strain(pair[1], pair[0]) = 1.0;
    motions.push_back(motionByStrain(strain, T_view_ct, centre_view_mm));
  }
  return motions;
}

/// A view's parameters by the layout's.
Eigen::MatrixXd carriedFrom(std::size_t view, const Setup& setup) {
  const SetupLayout layout(setup.views.size());
  Eigen::MatrixXd carried = Eigen::MatrixXd::Zero(kMotions, layout.size());
  carried.block<6, 6>(0, SetupLayout::kPose) = twistCarriedBy(setup.views[view].T_view_first);
  if (view > 0) carried.block<6, 6>(0, layout.of(view, SetupLayout::kViewPose)).setIdentity();
  carried.block<kCameraMotions, kCameraMotions>(6, layout.of(view, SetupLayout::kFocal)).setIdentity();
  carried.block<6, 6>(6 + kCameraMotions, SetupLayout::kStrain).setIdentity();
  return carried;
}

XrayCamera changed(XrayCamera level, const XrayCamera& told, const ViewSetup& setup) {
  level.cx += setup.centre_shift_px.x() * level.fx / told.fx;
  level.cy += setup.centre_shift_px.y() * level.fy / told.fy;
  level.fx *= setup.focal_scale;
  level.fy *= setup.focal_scale;
  return level;
}

Eigen::Affine3d stretchedAbout(const Eigen::Vector3d& centre_ct_mm, const Eigen::Matrix3d& stretch) {
  return Eigen::Translation3d(centre_ct_mm) * stretch * Eigen::Translation3d(-centre_ct_mm);
}

}  // namespace

void SetupObjective::addView(std::size_t index, const Setup& setup, const Stage& stage, double robust_scale2,
                             SetupEvidence* evidence) {
  const DeviceViews::View& view = views_->views()[index];
  const XrayCamera camera = changed(view.level(stage.level).camera, view.told, setup.views[index]);
  const RigidTransform T_view_ct = setup.views[index].T_view_first * setup.T_camera_ct;
  const TileProducts products =
      engine_->addUpTiles(view.xray.get(), stage.level, views_->volumeLevel(camera, T_view_ct), camera,
                          Eigen::Affine3d(T_view_ct) * stretchedAbout(centreCt(), setup.ct_stretch),
                          motionsOf(view.told, T_view_ct, T_view_ct * centreCt()));
  WindowOptions options = windowsFor(Similarity::kLocalNormalised, view.xray->deviation());
  options.span = stage.span;
  options.robust_scale2 = robust_scale2;
  Eigen::Matrix<double, kMotions, kMotions> matrix = Eigen::Matrix<double, kMotions, kMotions>::Zero();
  Eigen::MatrixXd gradients(kMotions, products.tiles_x * products.tiles_y);
  Eigen::Index count = 0;
  constexpr int kShift = 6 + SetupLayout::kCentre;
  const Matrix6d to_view = twistCarriedBy(setup.views[index].T_view_first);
  forEachWindow(products, options, [&](const WindowEvidence& window) {
    matrix += window.matrix;
    gradients.col(count++) = window.gradient;
    evidence->cost += window.cost;
    evidence->windows.push_back({index, window.x, window.y, window.content, window.correlation, window.cost,
                                 window.matrix.block<2, 2>(kShift, kShift),
                                 to_view.transpose() * window.matrix.block<6, 2>(0, kShift)});
  });
  evidence->mm_per_pixel.push_back((T_view_ct * centreCt()).z() / view.told.fx);
  const Eigen::MatrixXd carried = carriedFrom(index, setup);
  evidence->matrix += carried.transpose() * matrix * carried;
  const Eigen::Index before = evidence->gradients.cols();
  evidence->gradients.conservativeResize(carried.cols(), before + count);
  evidence->gradients.rightCols(count) = carried.transpose() * gradients.leftCols(count);
  evidence->gradient += evidence->gradients.rightCols(count).rowwise().sum();
}

std::optional<SetupEvidence> SetupObjective::evaluate(const Setup& setup, const Stage& stage, double robust_scale2) {
  if (!budget_->draw()) return std::nullopt;
  SetupEvidence evidence{SetupLayout(setup.views.size())};
  for (std::size_t i = 0; i < setup.views.size(); ++i) addView(i, setup, stage, robust_scale2, &evidence);
  return evidence;
}

}  // namespace xray_registration
