#pragma once

#include "registration/device_views.h"
#include "registration/stage.h"

namespace xray_registration {

/// What of a body's own shadow is found in the X-rays.
struct BodyEvidence {
  double similarity = 0.0;       ///< Partial correlation over all windows, −1…1.
  double inlier_fraction = 0.0;  ///< Share of the shadow in windows that correlate well by themselves.
  double shadow = 0.0;           ///< Pixels whose windows hold any of it.
};

/// The correlation of X-ray and body where both are cleared of what surrounds the body: with C the surroundings, in each
/// window, x = X − (cov(X,C)/var C) C and b = B − (cov(B,C)/var C) C; then Σ cov(x,b) / √(Σ var x · Σ var b) over the
/// windows. A plain correlation of X-ray and DRR does not do: what is well known around the body makes it high wherever
/// the body is. `views` look at the body's engine, with their surroundings. @throws DeviceError.
BodyEvidence evidenceFor(Engine* engine, DeviceViews* views, const RigidTransform& T_camera_body, const Stage& stage);

}  // namespace xray_registration
