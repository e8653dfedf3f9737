#include "tools/calibrate/session/frame_choice.h"

#include <algorithm>
#include <stdexcept>

#include "tools/common/progress_bar.h"
#include "xray_registration/pipeline/calibration_frames.h"

namespace xray_registration::tools {
namespace {

/// Frames to choose each one from.
constexpr std::size_t kCandidates = 3;
std::vector<std::size_t> spread(std::size_t all, std::size_t most) {
  std::vector<std::size_t> indices;
  const std::size_t count = std::min(all, most);
  for (std::size_t i = 0; i < count; ++i) indices.push_back(count > 1 ? i * (all - 1) / (count - 1) : 0);
  return indices;
}

/// Empty when the frame is of use.
std::string problemOf(const FrameOutcome& outcome) {
  if (!outcome.registered) return outcome.result.reason;
  if (outcome.result.similarity >= kAlikeEnoughToCalibrate) return "";
  return "X-ray and DRR are not alike (similarity " + std::to_string(outcome.result.similarity) + ")";
}

}  // namespace

FrameChoice chooseFrames(const ToldSession& session, const RigidTransform& start, std::size_t most,
                         RegistrationPipeline* pipeline) {
  FrameChoice choice;
  std::vector<RegisteredFrame> found;
  std::vector<RigidTransform> poses;
  pipeline->setPose(start);
  const std::vector<std::size_t> candidates = spread(session.bag().frameCount(), kCandidates * most);
  ProgressBar progress("registering", candidates.size());
  for (const std::size_t index : candidates) {
    const FrameOutcome outcome = pipeline->process(session.bag().stamp(index).toSec(), session.raw(index));
    if (!pipeline->fault().empty()) throw std::runtime_error("device failed: " + pipeline->fault());
    const std::string problem = problemOf(outcome);
    if (problem.empty()) {
      found.push_back({index, outcome.result.T_camera_ct});
      poses.push_back(outcome.result.T_camera_ct);
      // A refused frame leaves the tracker where it was, but the next one is near this one all the same.
      if (!outcome.result.accepted) pipeline->setPose(outcome.result.T_camera_ct);
    } else {
      ++choice.failed;
      choice.why_failed = "frame " + std::to_string(index) + ": " + problem;
    }
    progress.advanceTo(++choice.tried);
  }
  for (const std::size_t i : mostDifferent(poses, pipeline->centreCt(), most)) choice.frames.push_back(found[i]);
  choice.alike = found.size() - choice.frames.size();
  return choice;
}

}  // namespace xray_registration::tools
