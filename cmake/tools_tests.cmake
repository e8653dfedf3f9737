# Tests of what is in src/tools.

# xray_tool_test(<name>): test/tools/<name>_test.cpp, with what the tools share.
function(xray_tool_test name)
  set(target test_tools_${name})
  add_executable(${target} ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/${name}_test.cpp)
  target_link_libraries(${target} PRIVATE xray_registration_warnings)
  target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  # The devel space's folder of executables, or the build folder without ROS.
  target_compile_definitions(${target} PRIVATE XRAY_REGISTRATION_TOOLS="$<TARGET_FILE_DIR:render>")
  target_link_libraries(${target} PRIVATE ${ARGN} xray_registration_tools_common GTest::GTest GTest::Main)
  add_test(NAME tools.${name} COMMAND ${target})
  xray_test_limits(tools.${name} 300)
endfunction()

if(NOT XRAY_REGISTRATION_COMPUTE_ONLY)
  xray_tool_test(session_bodies)
  xray_tool_test(session_generator)
  xray_tool_test(yaml_files)
  xray_tool_test(motion_table)
  target_sources(test_tools_motion_table PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/register_bag/motion_table.cpp)
  xray_tool_test(ct_planes)
  target_sources(test_tools_ct_planes PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/inspect_ct/planes.cpp)
  add_test(NAME tools.inspect_ct COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/inspect_ct_test.py
           --tools $<TARGET_FILE_DIR:inspect_ct> --work ${CMAKE_CURRENT_BINARY_DIR}/test_work/inspect_ct)
  xray_test_limits(tools.inspect_ct 300)
  if(XRAY_REGISTRATION_ROS)
    xray_tool_test(bag_session xray_registration_tools_ros)
    xray_tool_test(calibrated_session xray_registration_tools_ros)
    target_sources(test_tools_calibrated_session PRIVATE ${calibrate}/session/calibrated_session.cpp)
    xray_tool_test(executables xray_registration_tools_ros)
    add_test(NAME tools.calibrate COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/calibrate_test.py
             --tools $<TARGET_FILE_DIR:calibrate> --work ${CMAKE_CURRENT_BINARY_DIR}/test_work/calibrate)
    # With the recorded sessions.
    xray_test_limits(tools.calibrate 900)
    foreach(name dicom_to_bag landmarks tutorial_dicom many_recordings hostile_inputs)
      add_test(NAME tools.${name} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/${name}_test.py
               --tools $<TARGET_FILE_DIR:calibrate> --work ${CMAKE_CURRENT_BINARY_DIR}/test_work/${name})
      xray_test_limits(tools.${name} 300)
    endforeach()
    # Where the package's folder is the checkout, rosrun shows the devel space's tools and nothing else of it.
    if(devel_inside_package EQUAL 0 AND NOT XRAY_REGISTRATION_SANITIZE)
      add_test(NAME tools.rosrun_list COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/rosrun_list_test.py
               --devel ${CATKIN_DEVEL_PREFIX})
      xray_test_limits(tools.rosrun_list 120)
      add_test(NAME docs.readme COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/docs/readme_test.py
               --devel ${CATKIN_DEVEL_PREFIX} --work ${CMAKE_CURRENT_BINARY_DIR}/test_work/readme)
      xray_test_limits(docs.readme 900)
    endif()
    add_test(NAME tools.plot_results COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/plot_results_test.py
             ${CMAKE_CURRENT_BINARY_DIR}/test_work/plot_results)
    xray_test_limits(tools.plot_results 300)
    foreach(name wrong_inputs moving_bodies peers soak latency)
      add_test(NAME tools.${name} COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/test/tools/${name}_test.py)
      xray_test_limits(tools.${name} 60)
    endforeach()
  endif()
endif()
