#include "registration/frame_checks.h"

namespace xray_registration {

std::string problemOf(const XrayFrame& view) {
  std::string problem = view.camera.problem();
  if (!problem.empty()) return problem;
  if (view.attenuation.width() != view.camera.width || view.attenuation.height() != view.camera.height) {
    return "the X-ray's size disagrees with its camera's";
  }
  if (!view.mask.empty() && (view.mask.width != view.camera.width || view.mask.height != view.camera.height)) {
    return "the mask's size disagrees with the X-ray's";
  }
  if (!view.attenuation.allFinite()) return "the X-ray holds values that are not finite";
  return {};
}

std::string problemOf(const std::vector<ViewInput>& views, const RigidTransform& T_camera_ct_start) {
  if (views.empty()) return "no view was given";
  if (!T_camera_ct_start.matrix().allFinite()) return "the start pose is not finite";
  for (const ViewInput& view : views) {
    std::string problem = problemOf(*view.xray);
    if (!problem.empty()) return problem;
  }
  return {};
}

}  // namespace xray_registration
