#include "xray_registration/ros/registration_node.h"

#include <ros/callback_queue.h>
#include <ros/init.h>
#include <ros/node_handle.h>

#include <csignal>
#include <exception>

#include "tools/common/node_help.h"
#include "xray_registration/common/frame_memory.h"
#include "xray_registration/ros/logger_service.h"

namespace {

constexpr char kHelp[] = R"(A ROS node that registers a CT to live X-ray images and publishes its pose.

Usage: rosrun xray_registration xray_registration_node [_<parameter>:=<value>...] [<topic>:=<other topic>...]
  --help, -h                    this

It wants a CT (_ct/path:=FILE, or the service ~load_ct), X-rays (image_raw and camera_info; several views by the
parameter views), and a first pose (parameter initial_pose, initialpose, ~set_initial_pose, ~register_landmarks, or
~localize, which needs none). roslaunch xray_registration register.launch ct:=FILE starts it; README.md has the
topics and services, docs/parameters.md every parameter. Research use only: this is not a medical device.
)";

/// All that a handler may touch. roscpp shuts down beside whatever runs, and a node that is just being made then waits
/// for its log for ever; so the node is made whole first, and ends by itself.
volatile std::sig_atomic_t is_to_end = 0;

extern "C" void askToEnd(int /*signal*/) { is_to_end = 1; }

void spinUntilAskedToEnd() {
  const ros::WallDuration look(0.1);
  while (ros::ok() && is_to_end == 0) ros::getGlobalCallbackQueue()->callAvailable(look);
}

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
    const xray_registration::LoggerService loggers(ros::NodeHandle("~"));
    const xray_registration::RegistrationNode registration(node, ros::NodeHandle("~"));
    spinUntilAskedToEnd();
    return 0;
  } catch (...) {
    return sayWhyItEnds();
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (xray_registration::tools::saidHelp(argc, argv, kHelp)) return 0;
  xray_registration::keepMemoryBetweenFrames();
  try {
    ros::init(argc, argv, "xray_registration");
    // With the last handle the log ends too: this one outlives whatever run() has to say.
    const ros::NodeHandle node;
    // Until here roscpp's own handler ends the wait for a master. A container or an init system sends SIGTERM.
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, askToEnd);
    return run(node);
  } catch (...) {
    return sayWhyItEnds();
  }
}
