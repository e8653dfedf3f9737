#include "registration/joint_frames.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "xray_registration/drr/tile_shape.h"
#include "xray_registration/drr/window_evidence.h"

namespace xray_registration {
namespace {

/// As a tracked frame's.
constexpr double kMaxImagePixels = 100000;
/// Half, but for where in the body they are measured.
constexpr double kVoxelsPerPixel = 0.45;
constexpr int kMotionLevel = 1;
constexpr int kMotionSpan = 2;
/// Pieces with less content or correlation say nothing about where they belong.
constexpr double kLeastContent = 0.3;
constexpr double kLeastCorrelation = 0.3;

}  // namespace

void JointFrames::make(const JointSetup& setup) {
  made_for_ = setup.views;
  frames_.resize(setup.T_camera_ct.size());
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    if (!frames_[i]) frames_[i] = std::make_unique<DeviceViews>(engine_);
    frames_[i]->upload(make_views_(i, setup.views), setup.T_camera_ct[i], kMaxImagePixels);
    frames_[i]->weigh(leave_out_, setup.T_camera_ct[i]);
  }
}

bool JointFrames::sameDistortion(const JointSetup& setup) const {
  return std::equal(setup.views.begin(), setup.views.end(), made_for_.begin(), made_for_.end(),
                    [](const ViewGeometry& a, const ViewGeometry& b) { return a.radial == b.radial; });
}

Setup JointFrames::setupOf(const JointSetup& joint, std::size_t frame) const {
  Setup setup;
  setup.T_camera_ct = joint.T_camera_ct[frame];
  for (std::size_t v = 0; v < joint.views.size(); ++v) {
    const ViewGeometry& view = joint.views[v];
    setup.views.push_back({view.focal_scale / made_for_[v].focal_scale,
                           view.centre_shift_px - made_for_[v].centre_shift_px, view.T_view_first});
  }
  return setup;
}

int JointFrames::lastLevel() const {
  int last = std::numeric_limits<int>::max();
  for (const auto& frame : frames_) last = std::min(last, frame->lastLevel());
  return last;
}

int JointFrames::levelOfCt(const JointSetup& setup) const {
  const double least_mm = kVoxelsPerPixel * engine_->volume().levels().front().spacing_mm;
  const DeviceViews& views = *frames_.front();
  int level = 0;
  const auto fine = [&](std::size_t v) {
    const double depth_mm = views.depthOf(setup.views[v].T_view_first * setup.T_camera_ct.front());
    return views.views()[v].level(level).camera.pixelSizeAt(depth_mm) < least_mm;
  };
  while (level < lastLevel()) {
    bool any = false;
    for (std::size_t v = 0; v < views.size(); ++v) any |= fine(v);
    if (!any) break;
    ++level;
  }
  return level;
}

std::vector<SetupEvidence> JointFrames::evaluate(const JointSetup& setup, const Stage& stage,
                                                 const std::vector<double>& robust_scales2) {
  if (!sameDistortion(setup)) make(setup);
  std::vector<SetupEvidence> all;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    StepBudget one(1);
    SetupObjective objective(engine_, frames_[i].get(), &one);
    all.push_back(std::move(*objective.evaluate(setupOf(setup, i), stage, robust_scales2[i])));
    if (progress_) progress_();
  }
  return all;
}

void JointFrames::addResidualMotion(const JointSetup& setup, std::size_t frame, std::size_t index,
                                    std::vector<ResidualMotion>* all) {
  const DeviceViews& views = *frames_[frame];
  const DeviceViews::View& view = views.views()[index];
  const int level = std::min(kMotionLevel, views.lastLevel());
  const XrayCamera& camera = view.level(level).camera;
  const RigidTransform T_view_ct = setup.views[index].T_view_first * setup.T_camera_ct[frame];
  const TileProducts products = engine_->addUpTiles(
      view.xray.get(), level, views.volumeLevel(camera, T_view_ct), camera, Eigen::Affine3d(T_view_ct),
      {motionByPrincipalPoint(0, view.told), motionByPrincipalPoint(1, view.told)});
  WindowOptions options = windowsFor(Similarity::kLocalNormalised, view.xray->deviation());
  options.span = kMotionSpan;
  options.robust_scale2 = kNotRobust;
  forEachWindow(products, options, [&](const WindowEvidence& window) {
    if (window.content < kLeastContent || window.correlation < kLeastCorrelation) return;
    const Eigen::Matrix2d matrix = window.matrix;
    if (!(matrix.determinant() > 0.0)) return;
    const Eigen::Vector2d tile(window.x + 0.5 * kMotionSpan, window.y + 0.5 * kMotionSpan);
    const Eigen::Vector2d in_level = kTilePixels * tile - Eigen::Vector2d::Constant(0.5);
    const Eigen::Vector3d ray = camera.rayDirection(in_level.x(), in_level.y());
    const Eigen::Vector2d gradient = window.gradient;
    all->push_back({frame, index, view.told.project(ray), -matrix.inverse() * gradient, window.correlation});
  });
}

std::vector<ResidualMotion> JointFrames::residualMotion(const JointSetup& setup) {
  std::vector<ResidualMotion> all;
  for (std::size_t frame = 0; frame < frames_.size(); ++frame) {
    for (std::size_t view = 0; view < setup.views.size(); ++view) addResidualMotion(setup, frame, view, &all);
  }
  return all;
}

}  // namespace xray_registration
