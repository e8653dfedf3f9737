# One small main per executable: src/tools/<name>.cpp. What several of them share is in src/tools/common.

# xray_tool(<name> [ROS] SOURCES ... LIBRARIES ...): an executable where rosrun looks. The compute-only build has none of
# the tools that need ITK, OpenCV or ROS.
function(xray_tool name)
  cmake_parse_arguments(TOOL "ROS" "" "SOURCES;LIBRARIES" ${ARGN})
  if(NOT TOOL_SOURCES)
    set(TOOL_SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/${name}.cpp)
  endif()
  add_executable(${name} ${TOOL_SOURCES})
  target_compile_options(${name} PRIVATE -Wall -Wextra -Werror)
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  if(TOOL_ROS)
    target_link_libraries(${name} PRIVATE xray_registration_tools_ros)
  endif()
  target_link_libraries(${name} PRIVATE ${TOOL_LIBRARIES} xray_registration_core)
  if(XRAY_REGISTRATION_ROS)
    install(TARGETS ${name} RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  endif()
endfunction()

if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  find_package(OpenCV REQUIRED COMPONENTS core imgproc imgcodecs)
  find_package(yaml-cpp REQUIRED)
  find_package(nlohmann_json REQUIRED)
  find_package(CLI11 REQUIRED)

  set(common ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/common)
  add_library(xray_registration_tools_common STATIC
    ${common}/command_line.cpp ${common}/ct_source.cpp ${common}/disturbance.cpp ${common}/image_files.cpp
    ${common}/pose_json.cpp ${common}/progress_bar.cpp ${common}/session_generator.cpp ${common}/trajectory.cpp
    ${common}/yaml_files.cpp)
  target_compile_options(xray_registration_tools_common PRIVATE -Wall -Wextra -Werror)
  target_include_directories(xray_registration_tools_common PUBLIC ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_include_directories(xray_registration_tools_common SYSTEM PUBLIC ${OpenCV_INCLUDE_DIRS})
  target_link_libraries(xray_registration_tools_common PUBLIC
    xray_registration_core CLI11::CLI11 nlohmann_json::nlohmann_json ${YAML_CPP_LIBRARIES} ${OpenCV_LIBS})

  xray_tool(render LIBRARIES xray_registration_tools_common)
  xray_tool(make_phantom LIBRARIES xray_registration_tools_common)
endif()

if(XRAY_REGISTRATION_ROS)
  add_library(xray_registration_tools_ros STATIC
    ${common}/bag_frames.cpp ${common}/message_files.cpp ${common}/session_messages.cpp)
  target_compile_options(xray_registration_tools_ros PRIVATE -Wall -Wextra -Werror)
  target_link_libraries(xray_registration_tools_ros PUBLIC xray_registration_tools_common xray_registration_ros)

  xray_tool(register_bag ROS)
  xray_tool(simulate_session ROS)
  xray_tool(simulator_node ROS)
  xray_tool(demo_monitor ROS)

  file(GLOB evaluate_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/evaluate/*.cpp)
  xray_tool(evaluate ROS SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/evaluate.cpp ${evaluate_sources})
endif()
