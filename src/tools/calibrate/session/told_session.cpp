#include "tools/calibrate/session/told_session.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "tools/common/bag_frames.h"
#include "tools/common/wrong_option.h"

namespace xray_registration::tools {
namespace {

std::vector<std::string> namesOf(const BagSession& session) {
  std::vector<std::string> names;
  for (const BagView& view : session.views()) names.push_back(view.name);
  return names;
}

}  // namespace

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

ToldSession::ToldSession(const BagSession* session, const ImageParameters& image, std::vector<WrongInput> wrong)
    : session_(session), wrong_(std::move(wrong)), maker_(image, namesOf(*session)) {}

std::vector<RawView> ToldSession::raw(std::size_t frame) const {
  std::vector<RawView> views = rawViews(*session_, session_->frame(frame));
  tellWrongViews(wrong_, &views);
  return views;
}

std::vector<ViewInput> ToldSession::views(std::size_t frame, const std::vector<ViewGeometry>& geometry) {
  std::vector<RawView> told = raw(frame);
  for (std::size_t i = 0; i < told.size(); ++i) {
    told[i].calibration = corrected(std::move(told[i].calibration), geometry[i]);
    told[i].T_view_first = geometry[i].T_view_first;
  }
  FrameViews made = maker_.make(std::move(told));
  std::vector<ViewInput> views;
  for (std::optional<ViewInput>& view : made.views) {
    if (!view) throw std::runtime_error(session_->path() + ": frame " + std::to_string(frame) + ": " + made.problem);
    views.push_back(std::move(*view));
  }
  return views;
}

}  // namespace xray_registration::tools
