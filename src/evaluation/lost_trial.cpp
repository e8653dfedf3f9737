#include "xray_registration/evaluation/lost_trial.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "xray_registration/drr/device.h"

namespace xray_registration {
namespace {

constexpr double kPeriodS = 0.1;

std::vector<RawView> blackViews(const EvaluationFrame& frame) {
  std::vector<RawView> views = frame.views;
  for (RawView& view : views) {
    RawPixels& pixels = view.image->pixels;
    pixels = FloatImage(pixels.width(), pixels.height());
  }
  return views;
}

FrameOutcome offer(RegistrationPipeline* pipeline, double stamp_s, const std::vector<RawView>& views,
                   const std::optional<RigidTransform>& T_camera_now_camera_last = std::nullopt) {
  FrameOutcome outcome = pipeline->process(stamp_s, views, T_camera_now_camera_last);
  if (outcome.state == TrackingState::kFault) throw DeviceError("the device failed: " + pipeline->fault(), 0);
  return outcome;
}

}  // namespace

Trial lostTrial(RegistrationPipeline* pipeline, const std::vector<EvaluationFrame>& frames, std::size_t first,
                const Twist& displacement, const Eigen::Vector3d& centre_ct_mm, double target_size_mm) {
  const std::vector<Eigen::Vector3d> targets_ct_mm = targetGrid(centre_ct_mm, target_size_mm);
  const RigidTransform& T_camera_ct_seen = frames[first].T_camera_ct_true;
  double stamp_s = frames.front().stamp_s;
  pipeline->reset();
  pipeline->setPose(T_camera_ct_seen);
  const FrameOutcome before = offer(pipeline, stamp_s, frames[first].views);
  if (!before.result.accepted) {
    throw std::runtime_error("the frame before the loss was not accepted: " + before.result.reason);
  }
  for (int i = 0; i < kBlackFrames; ++i) offer(pipeline, stamp_s += kPeriodS, blackViews(frames[first]));

  // That the camera moved so is told, and is not true: the CT is believed elsewhere.
  const RigidTransform T_camera_ct_believed =
      updatedPose(T_camera_ct_seen, displacement, T_camera_ct_seen * centre_ct_mm);
  const RigidTransform T_camera_now_camera_last = T_camera_ct_believed * before.result.T_camera_ct.inverse();
  Trial trial;
  for (int i = 0; i < kFramesToFindBack && !trial.result.accepted; ++i) {
    const EvaluationFrame& frame = frames[(first + static_cast<std::size_t>(i)) % frames.size()];
    const FrameOutcome outcome = offer(pipeline, stamp_s += kPeriodS, frame.views, T_camera_now_camera_last);
    trial.frame = frame.index;
    trial.stamp_s = frame.stamp_s;
    trial.result = outcome.result;
    if (!outcome.registered) trial.result.T_camera_ct = T_camera_ct_believed;
    trial.prepare_ms = outcome.prepare_ms;
    trial.solve_ms = outcome.total_ms - outcome.prepare_ms;
    trial.start = poseError(T_camera_ct_believed, frame.T_camera_ct_true, targets_ct_mm);
    trial.final = poseError(trial.result.T_camera_ct, frame.T_camera_ct_true, targets_ct_mm);
    trial.disturbance =
        twistBetween(frame.T_camera_ct_true, T_camera_ct_believed, frame.T_camera_ct_true * centre_ct_mm);
    trial.frames_to_find = i + 1;
  }
  return trial;
}

}  // namespace xray_registration
