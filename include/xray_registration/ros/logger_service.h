#pragma once

#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <roscpp/GetLoggers.h>

namespace xray_registration {

/// A ~get_loggers of the node's own in place of roscpp's, which with Debian's log4cxx (0.15) frees what the log lives
/// on: the next line that is logged from a new place, or the next call, ends the process. One for a process; its
/// callbacks come from `private_node`'s queue.
class LoggerService {
 public:
  explicit LoggerService(ros::NodeHandle private_node);

 private:
  static bool answer(roscpp::GetLoggers::Request& request, roscpp::GetLoggers::Response& response);

  ros::ServiceServer service_;
};

}  // namespace xray_registration
