#pragma once

#include <actionlib/server/simple_action_server.h>
#include <ros/node_handle.h>
#include <xray_registration/LocalizeAction.h>

#include <atomic>
#include <future>
#include <memory>

#include "xray_registration/ros/registration_worker.h"

namespace xray_registration {

/// The action ~localize: hands goals to the worker, and says what it hears. On a thread of its own.
class LocalizeServer {
 public:
  /// The worker outlives this.
  LocalizeServer(const ros::NodeHandle& private_node, RegistrationWorker* worker);
  ~LocalizeServer();

 private:
  void execute(const LocalizeGoalConstPtr& goal);
  void waitForLast();
  bool isPreempted();
  LocalizeResult wait(WideSearchTask* task);

  RegistrationWorker* worker_;
  std::atomic<bool> stopping_{false};
  std::future<WideSearchTask::Answer> answer_;  ///< Of the last goal; the worker may still be at it.
  std::unique_ptr<actionlib::SimpleActionServer<LocalizeAction>> server_;
};

}  // namespace xray_registration
