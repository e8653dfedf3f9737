#include "tools/calibrate/session/told_session.h"

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

ToldSession::ToldSession(const BagSession* session, const ImageParameters& image, std::vector<WrongInput> wrong)
    : session_(session), wrong_(std::move(wrong)), maker_(image, namesOf(*session)) {}

std::vector<RawView> ToldSession::raw(std::size_t frame) const {
  std::vector<RawView> views = rawViews(*session_, session_->frame(frame));
  tellWrongViews(wrong_, &views);
  return views;
}

std::vector<ViewInput> ToldSession::views(std::size_t frame, const std::vector<ViewGeometry>& geometry) {
  try {
    return correctedViews(raw(frame), geometry, &maker_);
  } catch (const FrameError& error) {
    throw std::runtime_error(session_->path() + ": frame " + std::to_string(frame) + ": " + error.what());
  }
}

}  // namespace xray_registration::tools
