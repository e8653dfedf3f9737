#include <algorithm>
#include <utility>

#include "xray_registration/ros/registration_worker.h"
#include "xray_registration/ros/result_transforms.h"

namespace xray_registration {
namespace {

// No patient is nearer to the source.
constexpr double kLeastDepthMm = 100.0;

void answer(WideSearchTask* task, const std::string& message) {
  WideSearchTask::Answer refusal;
  refusal.message = message;
  task->promise.set_value(std::move(refusal));
}

}  // namespace

std::future<WideSearchTask::Answer> RegistrationWorker::localize(const std::shared_ptr<WideSearchTask>& task) {
  std::future<WideSearchTask::Answer> result = task->promise.get_future();
  if (searching_.exchange(true)) {
    answer(task.get(), "another wide search goes on; ask again when that is done");
  } else if (!mailbox_.post([this, task] { beginSearch(task); })) {
    answer(task.get(), "the node is shutting down");
  }
  return result;
}

void RegistrationWorker::beginSearch(const std::shared_ptr<WideSearchTask>& task) {
  const std::string problem = searchProblem(task.get());
  if (problem.empty()) return advanceSearch(task);
  searching_ = false;
  log(logger_, LogLevel::kWarning, "~localize: " + problem);
  answer(task.get(), problem);
}

/// Begins the search in the newest frame; why that cannot be.
std::string RegistrationWorker::searchProblem(WideSearchTask* task) {
  if (!newest_) return "no X-ray has come yet that could be searched in";
  task->frame = *newest_;
  std_msgs::Header& header = task->frame.header;
  if (!task->frame.views.front().image) return "the newest frame has no image of the first view";
  if (std::string problem = frameProblem(header.frame_id, parameters_.frames, parameters_.bodies); !problem.empty()) {
    return problem;
  }
  if (std::string problem = lookUpCamera(header); !problem.empty()) return problem;
  WideSearchRange range;
  range.rotation_rad = task->rotation_rad;
  range.translation_mm = task->translation_mm;
  if (task->T_frame_ct_centre) {
    std::string why;
    const std::optional<RigidTransform> T_camera_frame =
        transforms_->lookup(header.frame_id, task->frame_id, header.stamp, parameters_.frames.tf_timeout_s, &why);
    if (!T_camera_frame) return why;
    range.T_camera_ct_centre = *T_camera_frame * *task->T_frame_ct_centre;
  } else {
    resolvePose(header);
    range.T_camera_ct_centre = pipeline_.prediction(header.stamp.toSec());
  }
  if (!range.T_camera_ct_centre) {
    if (std::string problem = searchDepths(header, &range); !problem.empty()) return problem;
  }
  return pipeline_.beginSearch(header.stamp.toSec(), rawViews(task->frame, header.frame_id), range);
}

/// How far from the first view's source a search without a centre looks; why that is not known.
std::string RegistrationWorker::searchDepths(const std_msgs::Header& header, WideSearchRange* range) const {
  const LocalizeParameters& localize = parameters_.localize;
  range->nearest_mm = localize.nearest_mm;
  range->farthest_mm = localize.farthest_mm;
  if (localize.centre_frame.empty()) return {};
  std::string why;
  const std::optional<RigidTransform> T_camera_centre =
      transforms_->lookup(header.frame_id, localize.centre_frame, header.stamp, parameters_.frames.tf_timeout_s, &why);
  if (!T_camera_centre) return "localize/centre_frame: " + why;
  // The axis crosses this distance; beside the axis the image itself says where the CT is.
  const double depth_mm = T_camera_centre->translation().z();
  range->nearest_mm = std::max(depth_mm - localize.centre_range_mm, kLeastDepthMm);
  range->farthest_mm = depth_mm + localize.centre_range_mm;
  if (range->farthest_mm > range->nearest_mm) return {};
  return "localize/centre_frame: '" + localize.centre_frame + "' lies behind the X-ray source of '" + header.frame_id +
         "'; is it the right frame, and does the optical frame's z point to the detector?";
}

/// One slice, then whatever else waits for the worker; so a reset, another CT, or the node's end get between.
void RegistrationWorker::advanceSearch(const std::shared_ptr<WideSearchTask>& task) {
  const auto is_wanted = [&task] { return !task->cancelled && std::chrono::steady_clock::now() < task->deadline; };
  const bool goes_on = is_wanted() && pipeline_.advanceSearch();
  task->progress = pipeline_.searchProgress();
  task->best_similarity = pipeline_.searchBestSimilarity();
  if (goes_on) {
    mailbox_.post([this, task] { advanceSearch(task); });
    return;
  }
  if (is_wanted()) {
    endSearch(task.get(), pipeline_.finishSearch(is_wanted));
    return;
  }
  pipeline_.dropSearch();
  searching_ = false;
  answer(task.get(),
         task->cancelled ? "the wide search was ended" : "the time limit passed before the search was done");
}

void RegistrationWorker::endSearch(WideSearchTask* task, const FrameOutcome& outcome) {
  if (outcome.registered) publishOutcome(task->frame, task->frame.header, outcome);
  updateStatistics();
  searching_ = false;
  const RegistrationResult& result = outcome.result;
  log(logger_, result.accepted ? LogLevel::kInfo : LogLevel::kWarning,
      result.accepted ? "~localize: the CT was found" : "~localize: nothing was accepted: " + result.reason);
  task->promise.set_value({result.accepted, result.reason, task->frame.header, result.T_camera_ct, result.similarity});
}

}  // namespace xray_registration
