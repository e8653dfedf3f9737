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
  # Not where rosrun looks.
  set_target_properties(${target} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/test)
  add_test(NAME ros.${name} COMMAND ${target})
  xray_test_limits(ros.${name} 120)
endforeach()

# With a master: the programs stand where rosrun looks, since rostest starts them by their package.
find_package(rostest REQUIRED)
foreach(name node live sim_time stamps health two_views bodies localize nodelet_cycles landmarks hand)
  add_executable(${name}_rostest ${CMAKE_CURRENT_SOURCE_DIR}/test/ros/${name}_rostest.cpp)
  target_link_libraries(${name}_rostest PRIVATE xray_registration_warnings)
  target_compile_definitions(${name}_rostest PRIVATE XRAY_REGISTRATION_SOURCE="${CMAKE_CURRENT_SOURCE_DIR}")
  target_include_directories(${name}_rostest PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(${name}_rostest PRIVATE xray_registration_ros GTest::GTest Threads::Threads)
endforeach()
set(rostests node nodelet live sim_time stamps health two_views bodies localize nodelet_cycles process landmarks hand)
list(APPEND rostests hostile)
# A sanitizer takes all the address space there is, so none can be limited (scripts/test says that it is skipped).
if(NOT XRAY_REGISTRATION_SANITIZE)
  list(APPEND rostests memory)
endif()
foreach(name IN LISTS rostests)
  # Each its own kernel cache: PoCL's is not safe against another process that writes it.
  set(cache ${CMAKE_CURRENT_BINARY_DIR}/pocl_cache/rostest_${name})
  file(MAKE_DIRECTORY ${cache})
  add_rostest(test/ros/${name}.test ARGS cache:=${cache})
endforeach()

# $(find xray_registration) resolves through the environment that the devel space sets.
add_test(NAME ros.launch_files COMMAND ${CATKIN_ENV} /usr/bin/python3
         ${CMAKE_CURRENT_SOURCE_DIR}/test/ros/launch_files_test.py)
set_tests_properties(ros.launch_files PROPERTIES TIMEOUT 120)
