#include "xray_registration/ros/registration_node.h"

#include <ros/init.h>
#include <ros/node_handle.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "xray_registration");
  const ros::NodeHandle node;
  const ros::NodeHandle private_node("~");
  try {
    const xray_registration::RegistrationNode registration(node, private_node);
    ros::spin();
  } catch (const xray_registration::ParameterError& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}
