#include "tools/evaluate/session_frames.h"

#include <stdexcept>
#include <string>

#include "tools/common/bag_frames.h"

namespace xray_registration::tools {

std::vector<EvaluationFrame> sessionFrames(const BagSession& session, const NodeParameters& parameters,
                                           std::size_t limit, const Logger& logger) {
  FrameMaker maker(parameters.image, parameters.viewNames());
  std::vector<EvaluationFrame> frames;
  std::size_t without_pose = 0;
  for (std::size_t i = 0; i < session.frameCount() && frames.size() < limit; ++i) {
    const BagFrame bag_frame = session.frame(i);
    if (!bag_frame.T_first_ct_true) {
      ++without_pose;
      continue;
    }
    EvaluationFrame frame;
    frame.index = static_cast<int>(i);
    frame.stamp_s = bag_frame.stamp.toSec();
    frame.views = rawViews(session, bag_frame);
    frame.T_camera_ct_true = *bag_frame.T_first_ct_true;
    frame.T_camera_bodies_true = bag_frame.T_first_bodies_true;
    const std::string problem = maker.make(frame.views).problem;
    if (problem.empty()) {
      frames.push_back(std::move(frame));
    } else {
      log(logger, LogLevel::kWarning, "frame " + std::to_string(i) + " is left out: " + problem);
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
