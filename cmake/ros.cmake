# The ROS library around the core, the node and the nodelet.
find_package(OpenCV REQUIRED COMPONENTS core imgproc imgcodecs calib3d)

file(GLOB ros_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/ros/*.cpp)
# The nodelet is a plugin of its own, so that no program that links the library registers it.
list(REMOVE_ITEM ros_sources ${CMAKE_CURRENT_SOURCE_DIR}/src/ros/registration_nodelet.cpp)

add_library(xray_registration_ros SHARED ${ros_sources})
add_dependencies(xray_registration_ros ${${PROJECT_NAME}_EXPORTED_TARGETS} ${catkin_EXPORTED_TARGETS})
target_link_libraries(xray_registration_ros PRIVATE xray_registration_warnings)
target_include_directories(xray_registration_ros PUBLIC
  $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>)
# The headers of other packages are not ours to warn about.
target_include_directories(xray_registration_ros SYSTEM PUBLIC
  ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_INCLUDE_DESTINATION}/.. ${catkin_INCLUDE_DIRS} ${OpenCV_INCLUDE_DIRS})
target_link_libraries(xray_registration_ros PUBLIC
  xray_registration_core ${catkin_LIBRARIES} ${YAML_CPP_LIBRARIES} ${OpenCV_LIBS}
  PRIVATE BZip2::BZip2)

# xray_ros_executable(<name> sources...): goes where rosrun looks.
function(xray_ros_executable name)
  add_executable(${name} ${ARGN})
  target_link_libraries(${name} PRIVATE xray_registration_warnings)
  target_link_libraries(${name} PRIVATE xray_registration_ros)
  install(TARGETS ${name} RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
endfunction()

if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/registration_node.cpp)
  xray_ros_executable(xray_registration_node src/tools/registration_node.cpp)
  target_include_directories(xray_registration_node PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  add_library(xray_registration_nodelet SHARED src/ros/registration_nodelet.cpp)
  target_link_libraries(xray_registration_nodelet PRIVATE xray_registration_warnings)
  target_link_libraries(xray_registration_nodelet PRIVATE xray_registration_ros)
  install(TARGETS xray_registration_nodelet LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION})
endif()

install(TARGETS xray_registration_core xray_registration_ros
        ARCHIVE DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
        LIBRARY DESTINATION ${CATKIN_PACKAGE_LIB_DESTINATION}
        RUNTIME DESTINATION ${CATKIN_GLOBAL_BIN_DESTINATION})
install(DIRECTORY include/${PROJECT_NAME}/ DESTINATION ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
install(FILES nodelet_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(DIRECTORY config launch rviz DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
