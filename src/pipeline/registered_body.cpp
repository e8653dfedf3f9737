#include "xray_registration/pipeline/registered_body.h"

namespace xray_registration {

void RegisteredBody::startFrom(const RigidTransform& T_camera_ct) {
  forgetPose();
  tracker.setPose(T_camera_ct);
}

void RegisteredBody::forgetPose() {
  tracker.reset();
  last_accepted_s.reset();
  if (registrar) registrar->forget();
}

}  // namespace xray_registration
