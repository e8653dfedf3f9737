#include "localize_server.h"

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>

#include "xray_registration/common/escaped.h"
#include "xray_registration/ros/conversions.h"
#include "xray_registration/ros/result_transforms.h"

namespace xray_registration {
namespace {

constexpr double kMmPerM = 1000.0;
constexpr double kDefaultRotationRad = 0.25 * 3.14159265358979323846;
constexpr double kDefaultTranslationMm = 100.0;
constexpr std::chrono::milliseconds kTurn{20};  // A preemption is seen within.
constexpr int kTurnsPerFeedback = 5;

double checkedRange(const char* name, double value, double largest) {
  if (std::isfinite(value) && value >= 0.0 && value <= largest) return value;
  throw std::invalid_argument(std::string(name) + " is " + std::to_string(value) + "; allowed: 0 to " +
                              std::to_string(largest));
}

/// @throws std::invalid_argument with what is wrong with the goal.
std::shared_ptr<WideSearchTask> taskOf(const LocalizeGoal& goal) {
  constexpr double kPi = 3.14159265358979323846;
  auto task = std::make_shared<WideSearchTask>();
  task->rotation_rad = checkedRange("rotation", goal.rotation, kPi);
  task->translation_mm = kMmPerM * checkedRange("translation", goal.translation, 10.0);
  const double limit_s = checkedRange("time_limit", goal.time_limit, 3600.0);
  if (task->rotation_rad == 0.0 && task->translation_mm == 0.0) {
    task->rotation_rad = kDefaultRotationRad;
    task->translation_mm = kDefaultTranslationMm;
  }
  if (limit_s > 0.0) {
    task->deadline = std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                                            std::chrono::duration<double>(limit_s));
  }
  task->frame_id = tfFrame(goal.centre.header.frame_id);
  if (!task->frame_id.empty()) task->T_frame_ct_centre = fromPose(goal.centre.pose, "the centre");
  return task;
}

}  // namespace

LocalizeServer::LocalizeServer(const ros::NodeHandle& private_node, RegistrationWorker* worker)
    : worker_(worker),
      server_(std::make_unique<actionlib::SimpleActionServer<LocalizeAction>>(
          private_node, "localize", [this](const LocalizeGoalConstPtr& goal) { execute(goal); }, false)) {
  server_->start();
}

LocalizeServer::~LocalizeServer() {
  stopping_ = true;
  server_.reset();
}

void LocalizeServer::execute(const LocalizeGoalConstPtr& goal) {
  LocalizeResult result;
  try {
    const std::shared_ptr<WideSearchTask> task = taskOf(*goal);
    waitForLast();
    answer_ = worker_->localize(task);
    result = wait(task.get());
  } catch (const std::invalid_argument& error) {
    result.message = escaped(error.what());
  } catch (const std::future_error&) {
    result.message = "the node is shutting down";
  }
  if (isPreempted()) return server_->setPreempted(result, result.message);
  if (result.success) return server_->setSucceeded(result);
  server_->setAborted(result, result.message);
}

bool LocalizeServer::isPreempted() { return stopping_ || server_->isPreemptRequested(); }

/// A goal that was preempted is answered at once, but a solve that goes on is not cut short.
void LocalizeServer::waitForLast() {
  while (answer_.valid() && !isPreempted() && answer_.wait_for(kTurn) != std::future_status::ready) {
  }
}

LocalizeResult LocalizeServer::wait(WideSearchTask* task) {
  LocalizeResult result;
  for (int turn = 0; answer_.wait_for(kTurn) != std::future_status::ready; ++turn) {
    if (isPreempted()) {
      task->cancelled = true;
      result.message = "the wide search was ended";
      return result;
    }
    if (turn % kTurnsPerFeedback != 0) continue;
    LocalizeFeedback feedback;
    feedback.progress = task->progress;
    feedback.best_similarity = task->best_similarity;
    server_->publishFeedback(feedback);
  }
  const WideSearchTask::Answer answer = answer_.get();
  result.success = static_cast<std::uint8_t>(answer.accepted);
  result.message = escaped(answer.message);
  result.pose.header = answer.header;
  result.pose.pose = toPose(answer.T_camera_ct);
  result.similarity = answer.similarity;
  return result;
}

}  // namespace xray_registration
