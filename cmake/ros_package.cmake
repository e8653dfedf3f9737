# The ROS side of the package: catkin's output folders (build/devel in a plain checkout), messages, parameters, exports.
# Debian's Python and its rospy: another interpreter may stand first in PATH.
if(NOT PYTHON_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "The interpreter that has rospy")
endif()
# catkin would otherwise look for its own copy of googletest; the tests of this package find theirs themselves.
set(CATKIN_ENABLE_TESTING ${XRAY_REGISTRATION_TESTS} CACHE BOOL "catkin's test targets")

set(xray_catkin_components
  actionlib actionlib_msgs diagnostic_msgs diagnostic_updater dynamic_reconfigure geometry_msgs image_transport
  interactive_markers nodelet pluginlib rosbag roscpp roslz4 sensor_msgs std_msgs std_srvs tf2 tf2_msgs tf2_ros
  visualization_msgs)
find_package(catkin REQUIRED COMPONENTS message_generation ${xray_catkin_components})
find_package(BZip2 REQUIRED)
find_package(yaml-cpp REQUIRED)

add_message_files(DIRECTORY msg FILES BodyStatus.msg RegistrationStatus.msg Suspicion.msg)
add_service_files(DIRECTORY srv FILES Calibrate.srv LoadCt.srv RegisterLandmarks.srv SetInitialPose.srv)
add_action_files(DIRECTORY action FILES Localize.action)
generate_messages(DEPENDENCIES actionlib_msgs geometry_msgs sensor_msgs std_msgs)
generate_dynamic_reconfigure_options(cfg/Accept.cfg cfg/Solver.cfg cfg/Tracking.cfg)
# Solver.cfg reads the list of similarities.
add_custom_command(OUTPUT ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_INCLUDE_DESTINATION}/SolverConfig.h APPEND
                   DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/include/${PROJECT_NAME}/drr/similarities.def)

catkin_package(
  INCLUDE_DIRS include
  LIBRARIES xray_registration_core xray_registration_ros
  CATKIN_DEPENDS message_runtime ${xray_catkin_components})

# A devel space inside the package, as in a plain checkout, needs help with rosrun; a workspace's does not.
string(FIND "${CATKIN_DEVEL_PREFIX}" "${CMAKE_CURRENT_SOURCE_DIR}/build/" devel_inside_package)
if(devel_inside_package EQUAL 0)
  file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/.package)
  file(RELATIVE_PATH package_from_hidden ${CMAKE_CURRENT_BINARY_DIR}/.package ${CMAKE_CURRENT_SOURCE_DIR})
  string(REGEX REPLACE "/$" "" package_from_hidden ${package_from_hidden})
  catkin_add_env_hooks(99.xray_registration SHELLS sh DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR}/cmake/env-hooks
                       SKIP_INSTALL)
endif()
