#pragma once

#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/ConfigDescription.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>

#include <functional>
#include <mutex>
#include <string>
#include <utility>

#include "live_parameters.h"

namespace xray_registration {

/// One group of parameters under dynamic_reconfigure's interface (set_parameters, parameter_descriptions,
/// parameter_updates below `node`). Its own dynamic_reconfigure::Server takes what it knows of a request and drops the
/// rest; here a request is taken whole or not at all, and the answer holds what is in force.
template <typename Config>
class TuningServer {
 public:
  using Apply = std::function<void(const Config&)>;
  using Refuse = std::function<void(const std::string&)>;

  /// `start`: what is in force. `apply`: is told what was asked for, `refuse`: why nothing was changed; both on the
  /// thread that serves `node`, one call at a time.
  TuningServer(const ros::NodeHandle& node, const Config& start, Apply apply, Refuse refuse)
      : node_(node), config_(start), apply_(std::move(apply)), refuse_(std::move(refuse)) {
    descriptions_ = node_.advertise<dynamic_reconfigure::ConfigDescription>("parameter_descriptions", 1, true);
    updates_ = node_.advertise<dynamic_reconfigure::Config>("parameter_updates", 1, true);
    dynamic_reconfigure::ConfigDescription description = Config::__getDescriptionMessage__();
    start.__toMessage__(description.dflt);
    descriptions_.publish(description);
    tell();
    service_ = node_.advertiseService("set_parameters", &TuningServer::set, this);
  }

 private:
  bool set(dynamic_reconfigure::Reconfigure::Request& request, dynamic_reconfigure::Reconfigure::Response& response) {
    const std::lock_guard<std::mutex> lock(mutex_);
    dynamic_reconfigure::Config known;
    config_.__toMessage__(known);
    Config asked = config_;
    std::string problem = unknownParameter(request.config, known);
    if (problem.empty()) {
      asked.__fromMessage__(request.config);
      problem = problemOf(asked);
    }
    if (problem.empty()) {
      asked.__clamp__();
      config_ = asked;
      apply_(config_);
      tell();
    } else {
      refuse_(node_.resolveName("set_parameters") + ": " + problem + "; nothing was changed");
    }
    config_.__toMessage__(response.config);
    return true;
  }

  void tell() {
    config_.__toServer__(node_);
    dynamic_reconfigure::Config message;
    config_.__toMessage__(message);
    updates_.publish(message);
  }

  ros::NodeHandle node_;
  std::mutex mutex_;
  Config config_;
  Apply apply_;
  Refuse refuse_;
  ros::Publisher descriptions_;
  ros::Publisher updates_;
  ros::ServiceServer service_;
};

}  // namespace xray_registration
