# One small main per executable: src/tools/<name>.cpp. What several of them share is in src/tools/common.

# xray_tool(<name> [ROS] SOURCES ... LIBRARIES ...): an executable where rosrun looks. The compute-only build has none of
# the tools that need ITK, OpenCV or ROS.
function(xray_tool name)
  cmake_parse_arguments(TOOL "ROS" "" "SOURCES;LIBRARIES" ${ARGN})
  if(NOT TOOL_SOURCES)
    set(TOOL_SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/${name}.cpp)
  endif()
  add_executable(${name} ${TOOL_SOURCES})
  target_link_libraries(${name} PRIVATE xray_registration_warnings)
  target_include_directories(${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  if(TOOL_ROS)
    target_link_libraries(${name} PRIVATE xray_registration_tools_ros)
  endif()
  target_link_libraries(${name} PRIVATE ${TOOL_LIBRARIES} xray_registration_core)
  if(XRAY_REGISTRATION_ROS)
    install(TARGETS ${name} RUNTIME DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  endif()
endfunction()

# The compute-only build does without them.
find_package(CLI11 QUIET)
find_package(nlohmann_json QUIET)

if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  foreach(library CLI11 nlohmann_json)
    if(NOT ${library}_FOUND)
      message(FATAL_ERROR "The tools need ${library}: libcli11-dev, nlohmann-json3-dev")
    endif()
  endforeach()

  set(common ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/common)
  add_library(xray_registration_tools_common STATIC
    ${common}/command_line.cpp ${common}/ct_options.cpp ${common}/ct_source.cpp ${common}/disturbance.cpp ${common}/image_files.cpp
    ${common}/json_files.cpp ${common}/picture.cpp ${common}/progress_bar.cpp ${common}/session_bodies.cpp
    ${common}/session_generator.cpp ${common}/trajectory.cpp
    ${common}/wrong_option.cpp ${common}/yaml_files.cpp)
  target_link_libraries(xray_registration_tools_common PRIVATE xray_registration_warnings)
  target_include_directories(xray_registration_tools_common PUBLIC ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(xray_registration_tools_common PUBLIC
    xray_registration_core CLI11::CLI11 nlohmann_json::nlohmann_json ${YAML_CPP_LIBRARIES}
    opencv_core opencv_imgproc opencv_imgcodecs)

  xray_tool(render LIBRARIES xray_registration_tools_common)
  xray_tool(make_phantom LIBRARIES xray_registration_tools_common)
  set(inspect_ct ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/inspect_ct)
  xray_tool(inspect_ct SOURCES ${inspect_ct}.cpp ${inspect_ct}/planes.cpp LIBRARIES xray_registration_tools_common)
  set(calibrate ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/calibrate)
  file(GLOB calibrate_sources CONFIGURE_DEPENDS ${calibrate}/*.cpp)
  file(GLOB landmarks_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/landmarks/*.cpp)
  list(APPEND landmarks_sources ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/landmarks.cpp)
  if(NOT XRAY_REGISTRATION_ROS)
    xray_tool(landmarks SOURCES ${landmarks_sources} LIBRARIES xray_registration_tools_common)
    xray_tool(calibrate SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/calibrate.cpp ${calibrate_sources}
              LIBRARIES xray_registration_tools_common)
  endif()
endif()

if(XRAY_REGISTRATION_ROS)
  add_library(xray_registration_tools_ros STATIC
    ${common}/bag_frames.cpp ${common}/message_files.cpp ${common}/session_messages.cpp ${common}/start_pose.cpp)
  target_link_libraries(xray_registration_tools_ros PRIVATE xray_registration_warnings)
  target_link_libraries(xray_registration_tools_ros PUBLIC xray_registration_tools_common xray_registration_ros)

  # From a session, which is a bag.
  file(GLOB calibrate_session_sources CONFIGURE_DEPENDS ${calibrate}/session/*.cpp)
  xray_tool(calibrate ROS SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/calibrate.cpp ${calibrate_sources}
            ${calibrate_session_sources})
  target_compile_definitions(calibrate PRIVATE XRAY_CALIBRATE_READS_BAGS)
  xray_tool(compare_poses ROS)
  file(GLOB register_bag_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/register_bag/*.cpp)
  xray_tool(register_bag ROS SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/register_bag.cpp ${register_bag_sources})
  xray_tool(landmarks ROS SOURCES ${landmarks_sources})
  target_compile_definitions(landmarks PRIVATE XRAY_LANDMARKS_READS_BAGS)
  file(GLOB dicom_to_bag_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/dicom_to_bag/*.cpp)
  xray_tool(dicom_to_bag ROS SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/dicom_to_bag.cpp ${dicom_to_bag_sources})
  xray_tool(simulate_session ROS SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/simulate_session.cpp
            ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/simulate_session/dicom_output.cpp)
  xray_tool(simulator_node ROS)
  xray_tool(demo_monitor ROS)

  # Scripts among the tools. The sources are not executable, nor is catkin_install_python used, which leaves a copy in the
  # build folder: rosrun asks which one is meant when it finds two. plot_results draws the tools' reports (evaluate --plot
  # looks for it where it stands itself), start_viewer is what the launch files start viewers with.
  foreach(script plot_results start_viewer)
    set(copy ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_BIN_DESTINATION}/${script})
    add_custom_command(OUTPUT ${copy} DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/scripts/${script}
      COMMAND install -m 755 ${CMAKE_CURRENT_SOURCE_DIR}/scripts/${script} ${copy})
    add_custom_target(${script} ALL DEPENDS ${copy})
    install(PROGRAMS scripts/${script} DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
  endforeach()

  # What measures speed and accuracy takes minutes, and says nothing about memory and threads that the tests do not.
  if(NOT XRAY_REGISTRATION_SANITIZE)
    file(GLOB evaluate_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/evaluate/*.cpp)
    xray_tool(evaluate ROS SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/evaluate.cpp ${evaluate_sources})
    add_dependencies(evaluate plot_results)
  endif()
endif()

# The benchmark is in every build; in the compute-only one it needs the headers of CLI11 and nlohmann-json alone.
if(XRAY_REGISTRATION_SANITIZE)
  message(STATUS "benchmark: a build with sanitizers leaves it out")
elseif(CLI11_FOUND AND nlohmann_json_FOUND)
  set(benchmark ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/benchmark)
  # What the kernels' own benchmark uses too.
  set(benchmark_scenes ${benchmark}/fast_step.cpp ${benchmark}/march_probe.cpp ${benchmark}/scenes.cpp)
  set(benchmark_sources ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/benchmark.cpp ${benchmark_scenes}
    ${benchmark}/camera_rows.cpp ${benchmark}/goals.cpp ${benchmark}/growth.cpp ${benchmark}/measure.cpp
    ${benchmark}/paper/paper_tables.cpp ${benchmark}/paper/paper_tables_print.cpp ${benchmark}/profile.cpp
    ${benchmark}/registration_rows.cpp ${benchmark}/report.cpp
    ${benchmark}/step_rows.cpp)
  if(XRAY_REGISTRATION_ROS)
    xray_tool(benchmark ROS SOURCES ${benchmark_sources} ${benchmark}/bag_rows.cpp)
    target_compile_definitions(benchmark PRIVATE XRAY_BENCHMARK_READS_BAGS)
  elseif(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
    xray_tool(benchmark SOURCES ${benchmark_sources} LIBRARIES xray_registration_tools_common)
  else()
    set(common ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/common)
    xray_tool(benchmark SOURCES ${benchmark_sources} ${common}/command_line.cpp ${common}/json_files.cpp
      ${common}/progress_bar.cpp
      LIBRARIES CLI11::CLI11 nlohmann_json::nlohmann_json)
  endif()
  if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
    target_compile_definitions(benchmark PRIVATE XRAY_BENCHMARK_READS_CT)
  endif()
  xray_embed_kernels(benchmark ${benchmark}/kernels/ceiling.cl)

  # Variants of the kernels, for whoever tries a new one (docs/performance.md). Needs libbenchmark-dev.
  find_package(benchmark QUIET)
  if(benchmark_FOUND)
    xray_tool(kernel_benchmark
      SOURCES ${CMAKE_CURRENT_SOURCE_DIR}/benchmark/kernel_benchmark.cpp
              ${CMAKE_CURRENT_SOURCE_DIR}/benchmark/march_by_hand.cpp ${benchmark_scenes}
      LIBRARIES benchmark::benchmark)
    xray_embed_kernels(kernel_benchmark ${benchmark}/kernels/ceiling.cl)
  else()
    message(STATUS "kernel_benchmark: Google Benchmark (libbenchmark-dev) is missing, it is left out")
  endif()
else()
  message(STATUS "benchmark: CLI11 or nlohmann-json is missing, the tool is left out")
endif()
