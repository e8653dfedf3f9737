#include "xray_registration/registration/registrar_options.h"

#include <tuple>

namespace xray_registration {
namespace {

auto solverPart(const RegistrarOptions& o) {
  return std::tie(o.method, o.similarity, o.max_steps_per_frame, o.max_image_pixels, o.tracking_precision_mm, o.search,
                  o.search_rotation_rad, o.search_translation_mm, o.search_poses, o.reach_rotation_rad,
                  o.reach_translation_mm, o.saturation, o.robust_weights, o.truncation_weights, o.paper_max_iterations,
                  o.paper_stop_norm, o.paper_step_deg, o.paper_step_mm, o.paper_image_size);
}

}  // namespace

bool solvesAlike(const RegistrarOptions& a, const RegistrarOptions& b) { return solverPart(a) == solverPart(b); }

}  // namespace xray_registration
