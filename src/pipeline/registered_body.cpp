#include "xray_registration/pipeline/registered_body.h"

namespace xray_registration {

RegistrarOptions RegisteredBody::optionsFrom(RegistrarOptions options) const {
  if (range) {
    options.search_rotation_rad = range->rotation_rad;
    options.search_translation_mm = range->translation_mm;
    options.reach_rotation_rad = range->rotation_rad;
    options.reach_translation_mm = range->translation_mm;
    options.saturation = range->saturation;
  }
  return options;
}

void RegisteredBody::startFrom(const RigidTransform& T_camera_ct, const std::vector<RigidTransform>& T_ct_bodies) {
  forgetPose();
  tracker.setPose(T_camera_ct, T_ct_bodies);
}

void RegisteredBody::forgetPose() {
  tracker.reset();
  last_accepted_s.reset();
  if (registrar) registrar->forget();
}

}  // namespace xray_registration
