#include "tools/common/bag_frames.h"

#include "xray_registration/ros/conversions.h"

namespace xray_registration::tools {

std::vector<std::string> viewParameter(const BagSession& session) {
  std::vector<std::string> names;
  for (const auto& view : session.views()) names.push_back(view.name);
  if (names.size() == 1 && names.front().empty()) names.clear();
  return names;
}

std::vector<RawView> rawViews(const BagSession& session, const BagFrame& frame) {
  std::vector<RawView> views;
  for (std::size_t i = 0; i < frame.views.size(); ++i) {
    const BagViewData& data = frame.views[i];
    RawView view;
    view.name = session.views()[i].name;
    view.T_view_first = session.views()[i].T_view_first;
    if (!data.image) {
      view.problem = "has no image";
    } else if (data.image->header.stamp.isZero()) {
      view.problem = "the image has no stamp (it is zero)";
    } else if (!data.camera_info) {
      view.problem = "has no camera_info with the stamp of the image";
    } else {
      try {
        view.image = rawImage(*data.image);
        view.calibration = calibration(*data.camera_info);
      } catch (const FrameError& error) {
        view.image.reset();
        view.problem = error.what();
      }
    }
    views.push_back(std::move(view));
  }
  return views;
}

}  // namespace xray_registration::tools
