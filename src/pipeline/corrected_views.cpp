#include "xray_registration/pipeline/corrected_views.h"

#include <algorithm>
#include <utility>

namespace xray_registration {

Calibration corrected(Calibration told, const ViewGeometry& geometry) {
  told.k[0] *= geometry.focal_scale;
  told.k[4] *= geometry.focal_scale;
  told.k[2] += geometry.centre_shift_px.x() * std::max(told.binning_x, 1);
  told.k[5] += geometry.centre_shift_px.y() * std::max(told.binning_y, 1);
  if (geometry.radial == 0.0) return told;
  if (told.distortion_model.empty()) told.distortion_model = "plumb_bob";
  if (told.distortion.empty()) told.distortion.assign(5, 0.0);
  told.distortion.front() += geometry.radial;
  return told;
}

std::vector<ViewInput> correctedViews(std::vector<RawView> told, const std::vector<ViewGeometry>& geometry,
                                      FrameMaker* maker) {
  for (std::size_t i = 0; i < told.size(); ++i) {
    told[i].calibration = corrected(std::move(told[i].calibration), geometry[i]);
    told[i].T_view_first = geometry[i].T_view_first;
  }
  FrameViews made = maker->make(std::move(told));
  std::vector<ViewInput> views;
  for (std::optional<ViewInput>& view : made.views) {
    if (!view) throw FrameError(made.problem);
    views.push_back(std::move(*view));
  }
  return views;
}

std::vector<ViewGeometry> toldGeometry(const std::vector<RawView>& views) {
  std::vector<ViewGeometry> told(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) told[i].T_view_first = views[i].T_view_first;
  return told;
}

}  // namespace xray_registration
