#include "tools/evaluate/session_frames.h"

#include <stdexcept>
#include <string>

#include "xray_registration/common/stopwatch.h"
#include "xray_registration/ros/conversions.h"

namespace xray_registration::tools {
namespace {

RawView rawView(const BagView& view, const BagViewData& data) {
  RawView raw;
  raw.name = view.name;
  raw.T_view_first = view.T_view_first;
  if (!data.image || !data.camera_info) {
    raw.problem = data.image ? "its image has no camera_info" : "it has no image";
    return raw;
  }
  raw.image = rawImage(*data.image);
  raw.calibration = calibration(*data.camera_info);
  return raw;
}

EvaluationFrame preparedFrame(const BagSession& session, const BagFrame& bag_frame,
                              const RegistrationPipeline& pipeline) {
  EvaluationFrame frame;
  frame.stamp_s = bag_frame.stamp.toSec();
  frame.T_camera_ct_true = *bag_frame.T_first_ct_true;
  const Stopwatch watch;
  for (std::size_t i = 0; i < session.views().size(); ++i) {
    frame.views.push_back(pipeline.makeView(rawView(session.views()[i], bag_frame.views[i])));
  }
  frame.prepare_ms = watch.milliseconds();
  return frame;
}

}  // namespace

std::vector<EvaluationFrame> sessionFrames(const BagSession& session, const RegistrationPipeline& pipeline,
                                           std::size_t limit, const Logger& logger) {
  std::vector<EvaluationFrame> frames;
  std::size_t without_pose = 0;
  for (std::size_t i = 0; i < session.frameCount() && frames.size() < limit; ++i) {
    const BagFrame bag_frame = session.frame(i);
    if (!bag_frame.T_first_ct_true) {
      ++without_pose;
      continue;
    }
    try {
      frames.push_back(preparedFrame(session, bag_frame, pipeline));
      frames.back().index = static_cast<int>(i);
    } catch (const FrameError& error) {
      log(logger, LogLevel::kWarning, "frame " + std::to_string(i) + " is left out: " + error.what());
    }
  }
  if (without_pose > 0) {
    log(logger, LogLevel::kInfo, std::to_string(without_pose) + " frames have no true pose and are passed over");
  }
  if (frames.empty()) {
    throw std::runtime_error(session.path() + ": no frame can be evaluated; each needs an image and a camera_info of " +
                             "every view and a pose on /<view>/ground_truth");
  }
  return frames;
}

}  // namespace xray_registration::tools
