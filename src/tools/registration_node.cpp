#include "xray_registration/ros/registration_node.h"

#include <ros/init.h>
#include <ros/node_handle.h>

#include <csignal>
#include <exception>

namespace {

/// As roscpp ends a node on SIGINT: in order.
extern "C" void endInOrder(int /*signal*/) { ros::requestShutdown(); }

/// Of what is being handled; gives the exit code.
int sayWhyItEnds() {
  try {
    throw;
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(xray_registration::onOneLine(error.what()));
  } catch (...) {
    ROS_FATAL("the node ends: something was thrown that is no exception");
  }
  return 1;
}

int run(const ros::NodeHandle& node) {
  try {
    const xray_registration::RegistrationNode registration(node, ros::NodeHandle("~"));
    ros::spin();
    return 0;
  } catch (...) {
    return sayWhyItEnds();
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    ros::init(argc, argv, "xray_registration");
    // With the last handle the log ends too: this one outlives whatever run() has to say.
    const ros::NodeHandle node;
    std::signal(SIGTERM, endInOrder);  // roscpp takes SIGINT alone, and a container or an init system sends this one.
    return run(node);
  } catch (...) {
    return sayWhyItEnds();
  }
}
