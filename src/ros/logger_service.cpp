#include "xray_registration/ros/logger_service.h"

#include <ros/console.h>
#include <ros/console_impl.h>
#include <ros/service_manager.h>

#include <array>
#include <string>
#include <utility>

namespace xray_registration {
namespace {

using ros::console::levels::Level;

/// The lowest level that is written.
std::string levelOf(const std::string& logger) {
  constexpr std::array<std::pair<Level, const char*>, 5> kLevels = {{{ros::console::levels::Debug, "debug"},
                                                                     {ros::console::levels::Info, "info"},
                                                                     {ros::console::levels::Warn, "warn"},
                                                                     {ros::console::levels::Error, "error"},
                                                                     {ros::console::levels::Fatal, "fatal"}}};
  void* const handle = ros::console::impl::getHandle(logger);
  for (const auto& [level, name] : kLevels) {
    if (ros::console::impl::isEnabledFor(handle, level)) return name;
  }
  return "none";
}

}  // namespace

LoggerService::LoggerService(ros::NodeHandle private_node) {
  ros::ServiceManager::instance()->unadvertiseService(private_node.resolveName("get_loggers"));
  service_ = private_node.advertiseService("get_loggers", &LoggerService::answer);
}

/// Those that this package writes to, and the one above them.
bool LoggerService::answer(roscpp::GetLoggers::Request& /*request*/, roscpp::GetLoggers::Response& response) {
  for (const std::string name : {ROSCONSOLE_ROOT_LOGGER_NAME, ROSCONSOLE_DEFAULT_NAME}) {
    roscpp::Logger logger;
    logger.name = name;
    logger.level = levelOf(name);
    response.loggers.push_back(logger);
  }
  return true;
}

}  // namespace xray_registration
