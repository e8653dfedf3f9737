#include "registration/body_evidence.h"

#include <cmath>

#include "xray_registration/drr/window_evidence.h"

namespace xray_registration {
namespace {

/// Vectors of the tiles: 1, DRR (with all that surrounds the body), X-ray, the body's part of the DRR.
constexpr Eigen::Index kSum = 1;
constexpr Eigen::Index kXray = 2;
constexpr Eigen::Index kBody = 3;

constexpr double kFlat = 0.005;             ///< Deviation, line integral, below which nothing is seen.
constexpr double kInlierCorrelation = 0.4;  ///< As of whole windows (opencl/layout.h).

/// Covariances of one window, cleared of the surroundings.
struct Cleared {
  double xray_body = 0.0;
  double xray = 0.0;
  double body = 0.0;
};

Cleared clearedOfSurroundings(const WindowCovariance& c) {
  const double body_around = c(kSum, kBody) - c(kBody, kBody);
  const double xray_around = c(kSum, kXray) - c(kBody, kXray);
  const double around = c(kSum, kSum) - 2.0 * c(kSum, kBody) + c(kBody, kBody);
  const double inverse = 1.0 / (std::max(around, 0.0) + kFlat * kFlat);
  return {c(kBody, kXray) - body_around * xray_around * inverse,
          std::max(c(kXray, kXray) - xray_around * xray_around * inverse, 0.0),
          std::max(c(kBody, kBody) - body_around * body_around * inverse, 0.0)};
}

}  // namespace

BodyEvidence evidenceFor(Engine* engine, DeviceViews* views, const RigidTransform& T_camera_body, const Stage& stage) {
  double xray_body = 0.0;
  double xray = 0.0;
  double body = 0.0;
  double recognised = 0.0;
  BodyEvidence evidence;
  for (const DeviceViews::View& view : views->views()) {
    views->drawSurroundings(view, stage.level);
    const XrayCamera& camera = view.level(stage.level).camera;
    const RigidTransform T_view_body = view.T_view_first * T_camera_body;
    const TileProducts products =
        engine->addUpTiles(view.xray.get(), stage.level, views->volumeLevel(camera, T_view_body), camera,
                           Eigen::Affine3d(T_view_body), {motionByDensity()});
    forEachWindowCovariance(products, stage.span, [&](double pixels, const WindowCovariance& covariance) {
      const Cleared cleared = clearedOfSurroundings(covariance);
      xray_body += pixels * cleared.xray_body;
      xray += pixels * cleared.xray;
      body += pixels * cleared.body;
      if (cleared.body > kFlat * kFlat) evidence.shadow += pixels;
      const double correlation =
          cleared.xray_body / std::sqrt((cleared.xray + kFlat * kFlat) * (cleared.body + kFlat * kFlat));
      if (correlation > kInlierCorrelation) recognised += pixels * cleared.body;
    });
  }
  if (body > 0.0 && xray > 0.0) {
    evidence.similarity = xray_body / std::sqrt(xray * body);
    evidence.inlier_fraction = recognised / body;
  }
  return evidence;
}

}  // namespace xray_registration
