# Tests of the ROS side: test/ros/<name>_test.cpp without a master, test/ros/<name>.test with one.
file(GLOB files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/test/ros/*_test.cpp)
foreach(file IN LISTS files)
  get_filename_component(name ${file} NAME_WE)
  string(REGEX REPLACE "_test$" "" name ${name})
  set(target test_ros_${name})
  add_executable(${target} ${file})
  target_link_libraries(${target} PRIVATE xray_registration_warnings)
  target_compile_definitions(${target} PRIVATE XRAY_REGISTRATION_SOURCE="${CMAKE_CURRENT_SOURCE_DIR}")
  target_include_directories(${target} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(${target} PRIVATE xray_registration_ros GTest::GTest GTest::Main Threads::Threads)
  add_test(NAME ros.${name} COMMAND ${target})
  xray_test_limits(ros.${name} 120)
endforeach()

# With a master. rostest starts programs by their package: it looks through all of a plain checkout, its build folder
# included; of a workspace it knows the package's own folders, so they stand beside the tools there.
# In a build with sanitizers too: another build beside it has programs of the same names.
if(NOT devel_inside_package EQUAL 0 OR XRAY_REGISTRATION_SANITIZE)
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_BIN_DESTINATION})
endif()
find_package(rostest REQUIRED)
foreach(name node live sim_time stamps health two_views bodies localize nodelet_cycles landmarks hand)
  add_executable(${name}_rostest ${CMAKE_CURRENT_SOURCE_DIR}/test/ros/${name}_rostest.cpp)
  target_link_libraries(${name}_rostest PRIVATE xray_registration_warnings)
  target_compile_definitions(${name}_rostest PRIVATE XRAY_REGISTRATION_SOURCE="${CMAKE_CURRENT_SOURCE_DIR}")
  target_include_directories(${name}_rostest PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(${name}_rostest PRIVATE xray_registration_ros GTest::GTest Threads::Threads)
endforeach()
# The node with the layer that fails calls of OpenCL in it, and the test that tells it which.
add_executable(failing_node ${CMAKE_CURRENT_SOURCE_DIR}/src/tools/registration_node.cpp ${failing_opencl})
target_link_libraries(failing_node PRIVATE xray_registration_warnings)
target_include_directories(failing_node PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/src)
target_link_libraries(failing_node PRIVATE xray_registration_ros ${CMAKE_DL_LIBS})
# Exported, its functions go before the library's. Not where rosrun looks.
set_target_properties(failing_node PROPERTIES ENABLE_EXPORTS ON
                      RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/test)
add_executable(failing_device_rostest ${CMAKE_CURRENT_SOURCE_DIR}/test/ros/failing_device_rostest.cpp
               ${failing_opencl})
target_link_libraries(failing_device_rostest PRIVATE xray_registration_warnings)
target_include_directories(failing_device_rostest PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
target_compile_definitions(failing_device_rostest PRIVATE XRAY_FAILING_NODE="$<TARGET_FILE:failing_node>")
target_link_libraries(failing_device_rostest PRIVATE xray_registration_ros GTest::GTest Threads::Threads
                      ${CMAKE_DL_LIBS})
add_dependencies(failing_device_rostest failing_node)
set(rostests node nodelet live sim_time stamps health two_views bodies localize nodelet_cycles process failing_device console
    hostile agreement bag_loop landmarks hand)
# A sanitizer takes all the address space there is, so none can be limited, and is loaded before anything that plays with
# the clock (scripts/test says that these are skipped).
if(NOT XRAY_REGISTRATION_SANITIZE)
  list(APPEND rostests memory clock_steps)
  add_library(shifted_clock MODULE ${CMAKE_CURRENT_SOURCE_DIR}/test/ros/shifted_clock.cpp)
  target_link_libraries(shifted_clock PRIVATE xray_registration_warnings ${CMAKE_DL_LIBS})
  # Not where rosrun looks.
  set_target_properties(shifted_clock PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/test)
  set(clock_steps_arguments clock:=${CMAKE_CURRENT_BINARY_DIR}/test/libshifted_clock.so)
endif()
foreach(name IN LISTS rostests)
  # Each its own kernel cache: PoCL's is not safe against another process that writes it.
  set(cache ${CMAKE_CURRENT_BINARY_DIR}/pocl_cache/rostest_${name})
  file(MAKE_DIRECTORY ${cache})
  add_rostest(test/ros/${name}.test ARGS cache:=${cache} ${${name}_arguments})
endforeach()

# $(find xray_registration) resolves through the environment that the devel space sets.
add_test(NAME ros.launch_files COMMAND ${CATKIN_ENV} /usr/bin/python3
         ${CMAKE_CURRENT_SOURCE_DIR}/test/ros/launch_files_test.py)
set_tests_properties(ros.launch_files PROPERTIES TIMEOUT 120)
